"""Detection of shared samples of recordings, as of partial, subsampled or concatenated copies.

Because of noise, no two motions have the same positions and currents of all joints in one sample. Hashes of rows
identify a recording, computed from numbers without their last digits, which other formats may omit. Repeated rows, as
of an arm at rest, are ignored. Of the others the smallest hashes are used, so that parts of a recording retain their
share.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.recordings.recording import Recording
from ident.support.once import once_per_object

MARKS = 64
"""Number of hashes of a recording: a copy of a tenth of its rows has two of them in 99 of 100 cases."""
TWO = 2
"""Number of common hashes of a copy; a single one may be a coincidence, or the row at which a log was split."""
BITS = 12
"""Bits of a number, 3.6 digits; a log written with six digits has nearly all of its hashes."""
ODD, SHIFT, DIGITS = np.uint64(0x9E3779B97F4A7C15), np.uint64(29), np.uint64(2**48 - 1)


def marks(recording: Recording) -> tuple[str, ...]:
    """Return the hashes of a recording, hexadecimal; fewer than `MARKS` if fewer rows are unique."""
    return tuple(f"{int(each & DIGITS):012x}" for each in _hashes(recording)[:MARKS])


def holds_marks(recording: Recording, given: Sequence[str]) -> bool:
    """Return whether a recording has rows of one with these hashes."""
    own, asked = _in_order(recording), np.array([int(each, 16) for each in given], np.uint64)
    held = np.searchsorted(own, asked, side="right") > np.searchsorted(own, asked)
    return int(held.sum()) >= TWO


def share_samples(one: Recording, other: Recording) -> bool:
    """Return whether one recording has some or all rows of the other."""
    return holds_marks(one, marks(other)) or holds_marks(other, marks(one))


@once_per_object
def _hashes(recording: Recording) -> NDArray[np.uint64]:
    """Return the hashes of unique rows, in increasing order."""
    fraction, power = np.frexp(np.hstack((recording.q, recording.v)))
    rounded = np.ldexp(np.rint(np.ldexp(fraction, BITS)), power - BITS) + 0.0  # also for -0.0
    rows = np.ascontiguousarray(rounded, dtype="<f8").view("<u8")
    found = np.zeros(len(rows), np.uint64)
    for column in rows.T:
        found = (found ^ column) * ODD
        found ^= found >> SHIFT
    value, count = np.unique(found, return_counts=True)
    return value[count == 1]


@once_per_object
def _in_order(recording: Recording) -> NDArray[np.uint64]:
    """Return the digits of the hashes that `marks` has, in increasing order."""
    return np.sort(_hashes(recording) & DIGITS)
