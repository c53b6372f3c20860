"""The resolution of a column of numbers, from the numbers alone."""

import numpy as np

from ident.support.arrays import Array

DIGITS = 1e-9
"""Share of the largest step below which two values are one, written in two ways."""
WHOLE = 0.02
"""Deviation from a whole number of quanta, as a share of one, that rounding of a file makes."""
SHARE = 0.99
"""Share of the samples that are whole numbers of quanta."""


def quantum(x: Array) -> float | None:
    """The step that all values of a column are whole multiples of, shape (N,); None where there is none to be seen."""
    step = np.diff(np.unique(x))
    step = step[step > DIGITS * step.max(initial=0.0)]
    if len(step) < 2:
        return None
    least = float(step.min())
    several = step / np.rint(step / least)  # single steps are rounded by the file; their mean is not
    least = float(np.sum(np.rint(step / least) * several) / np.sum(np.rint(step / least)))
    off = np.abs(step / least - np.rint(step / least))
    return least if float(np.mean(off < WHOLE)) > SHARE and 2 * (len(step) + 1) < len(x) + 2 else None
