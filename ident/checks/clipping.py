"""Currents that stand at one extreme value for a while: a drive at its limit, or a log that was clipped."""

import numpy as np

from ident.arrays import Array
from ident.checks.remark import Grade, Remark
from ident.recording import Recording

LEAST = 4
"""Samples in a row at the very largest value from which it is a limit, not a peak."""
SHARE = 0.0005
"""Share of the samples at it, besides."""


def clipped(v: Array, extreme: float) -> int:
    """Samples of a current, shape (N,), in runs of at least `LEAST` at exactly its extreme value."""
    at = np.concatenate(([0], (v == extreme).astype(np.int8), [0]))
    starts, ends = np.flatnonzero(np.diff(at) > 0), np.flatnonzero(np.diff(at) < 0)
    lengths = ends - starts
    return int(lengths[lengths >= LEAST].sum())


def clipping_remarks(recording: Recording) -> list[Remark]:
    """Which currents are clipped, and where."""
    found: list[Remark] = []
    for j in range(recording.n):
        v = recording.v[:, j]
        for name, extreme in (("largest", float(v.max())), ("smallest", float(v.min()))):
            samples = clipped(v, extreme)
            if samples > SHARE * len(v) and not _steps(v, extreme):
                first = recording.t[int(np.argmax(v == extreme))]
                found.append(
                    Remark(
                        topic="clipping",
                        log=recording.name,
                        joint=j,
                        seen=f"v{j + 1} stays at its {name} value {extreme:.4g} for {samples} samples, "
                        f"first at t = {first:.6g} s",
                        grade=Grade.WRONG,
                        advice="a slower motion or a lighter payload keeps off the limit",
                    )
                )
    return found or [Remark(topic="clipping", log=recording.name, seen="none")]


def _steps(v: Array, extreme: float) -> bool:
    """Whether the value before the extreme one is held as long: a coarse or slowly logged current, no limit."""
    others = v[v != extreme]
    if not len(others):
        return False
    near = float(others.max() if extreme > others.max() else others.min())
    return 2 * int(np.sum(v == near)) > int(np.sum(v == extreme))
