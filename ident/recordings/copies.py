"""Whether recordings share samples, as a copy that was cut, thinned or put together with others does.

No two motions show the same positions and currents of all joints at once: noise is in every one. Hashes of rows mark a
recording, by the numbers without the last digits, which other formats leave out. Rows that a recording repeats, as of
an arm at rest, are left out; of the others the smallest hashes are kept, so that parts of a recording keep their share.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ident.recordings.recording import Recording

MARKS = 64
"""Of a recording: two of them are in 99 of 100 copies of a tenth of its rows."""
TWO = 2
"""Marks that a copy has; one may be chance, with coarse numbers, or the row where a log was cut in two."""
BITS = 12
"""Of a number, 3.6 digits; a log written with six keeps nearly all of its hashes."""
ODD, SHIFT, DIGITS = np.uint64(0x9E3779B97F4A7C15), np.uint64(29), np.uint64(2**48 - 1)


def marks(recording: Recording) -> tuple[str, ...]:
    """Marks of a recording, hexadecimal; fewer than `MARKS` where fewer rows occur once."""
    return tuple(f"{int(each & DIGITS):012x}" for each in _hashes(recording)[:MARKS])


def holds_marks(recording: Recording, given: Sequence[str]) -> bool:
    """Whether a recording holds rows of one that is marked so."""
    own = _hashes(recording) & DIGITS
    return int(np.isin(np.array([int(each, 16) for each in given], np.uint64), own).sum()) >= TWO


def share_samples(one: Recording, other: Recording) -> bool:
    """Whether one recording holds rows of the other: all of them or some."""
    return holds_marks(one, marks(other)) or holds_marks(other, marks(one))


@lru_cache(maxsize=16)  # every pair of logs asks for both
def _hashes(recording: Recording) -> NDArray[np.uint64]:
    """Hashes of the rows that occur once, in rising order."""
    fraction, power = np.frexp(np.hstack((recording.q, recording.v)))
    rounded = np.ldexp(np.rint(np.ldexp(fraction, BITS)), power - BITS) + 0.0  # of -0.0 as well
    rows = np.ascontiguousarray(rounded, dtype="<f8").view("<u8")
    found = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        found = (found ^ column) * ODD
        found ^= found >> SHIFT
    value, count = np.unique(found, return_counts=True)
    return value[count == 1]
