"""Array conventions: read-only once stored in a dataclass."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Mask: TypeAlias = npt.NDArray[np.bool_]
Indices: TypeAlias = npt.NDArray[np.intp]
MaskedArray: TypeAlias = np.ma.MaskedArray[tuple[int, ...], np.dtype[np.float64]]
"""Numbers, some of which may be None."""


def readonly(values: npt.ArrayLike) -> Array:
    """Return a read-only float64 copy of `values`, so that no two objects share writable memory."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
