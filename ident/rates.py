"""Whether logs were sampled at one rate: a clock that counts otherwise in one of them looks like another rate."""

from collections.abc import Sequence

import numpy as np

from ident.recording import Recording

DIFFERENT = 0.02
"""Relative difference of rates that is worth a word; a clock off by as much errs inertias by twice that."""


def hertz_of(recording: Recording) -> float:
    """The usual rate of a log [Hz]."""
    return 1.0 / float(np.median(np.diff(recording.t)))


def rate_notes(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """A note on every log whose usual rate is not that of the first."""
    hertz = [hertz_of(each) for each in recordings]
    return tuple(
        f"{each.name}: sampled at {rate:.4g} Hz, {recordings[0].name} at {hertz[0]:.4g} Hz; was it set so, or does t "
        "count otherwise in one of them? Inertias, and gains that rest on them, go with its square"
        for each, rate in zip(recordings[1:], hertz[1:], strict=True)
        if abs(rate / hertz[0] - 1.0) > DIFFERENT
    )
