"""Arrays, read-only once stored in a dataclass, and results that are computed once for such a dataclass."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Generic, TypeAlias, TypeVar, TypeVarTuple
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Mask: TypeAlias = npt.NDArray[np.bool_]
Indices: TypeAlias = npt.NDArray[np.intp]
MaskedArray: TypeAlias = np.ma.MaskedArray[tuple[int, ...], np.dtype[np.float64]]
"""Numbers, some of which may be None."""
Of = TypeVar("Of")
More = TypeVarTuple("More")
Result = TypeVar("Result")
SINGULAR = 1e-6
"""Inverse of the condition number from which a transmission is singular."""


def readonly(values: npt.ArrayLike) -> Array:
    """Return `values` as read-only float64; no two objects share writable memory, so writable arrays are copied."""
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable or array.base is not None:
        array = array.copy()
    array.flags.writeable = False
    return array


def numbers(values: npt.ArrayLike) -> Array:
    """Return a read-only copy of real numbers; raises `ValueError` for masked, complex or other values."""
    if np.ma.is_masked(values):
        raise ValueError("it has masked values")
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise ValueError(f"it has values of type {array.dtype}")
    return readonly(array)


def once_per_object(function: Callable[[Of, *More], Result]) -> Callable[[Of, *More], Result]:
    """Call a function once for each object, its first argument, and each set of further arguments.

    Results are kept as long as their object, and errors are not kept. The object is immutable and compared by identity,
    further arguments are hashable; a result must not refer to the object, else neither is ever freed.
    """
    known = WeakKeyDictionary[Of, dict[tuple[*More], Result]]()

    @wraps(function)
    def called(of: Of, /, *more: *More) -> Result:
        results = known.setdefault(of, {})
        if more not in results:
            results[more] = function(of, *more)
        return results[more]

    return called


PIECE = 4096
"""Number of samples of a piece: 34 s of a motion with the default filters."""


@dataclass(frozen=True, slots=True, eq=False)
class Pieces(Generic[Result]):
    """Results by pieces of a motion; that of a single piece is kept, but those of a long motion are large."""

    samples: int  # number of samples
    of: Callable[[slice], Result]  # function that computes the result of a piece
    only: list[Result] = field(default_factory=list[Result])  # that of a single piece, once it is known

    def __getitem__(self, piece: slice) -> Result:
        """Return the result of a piece."""
        if self.samples > PIECE:
            return self.of(piece)
        if not self.only:
            self.only.append(self.of(piece))
        return self.only[0]

    def __iter__(self) -> Iterator[tuple[slice, Result]]:
        """Yield the pieces and their results, in order."""
        pieces = (slice(start, start + PIECE) for start in range(0, self.samples, PIECE))
        return ((piece, self[piece]) for piece in pieces)


def transmission_fault(A: Array | Sequence[Sequence[float]], n: int, *, coupled: bool) -> str | None:
    """Return why the motors of n joints, which may be coupled, cannot turn by q_motor = A q; None if they can."""
    if len(A) != n or any(np.shape(row) != (n,) or not np.isfinite(row).all() for row in A):
        return f"expected {n} rows of {n} numbers, q_motor = A q"
    if coupled:
        return "it states what coupling does; give one of both"
    size = np.linalg.norm(A, axis=1, keepdims=True)
    if not size.all() or np.linalg.cond(A / size) > 1.0 / SINGULAR:
        return "the matrix is singular; expected motors that move all joints"
    return None
