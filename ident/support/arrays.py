"""Arrays, read-only once stored in a dataclass, and results that are computed once for such a dataclass."""

from collections.abc import Callable
from functools import wraps
from typing import TypeAlias, TypeVar, TypeVarTuple
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


def readonly(values: npt.ArrayLike) -> Array:
    """Return a read-only float64 copy of `values`, so that no two objects share writable memory."""
    array = np.array(values, dtype=np.float64)
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
