"""Selection of the best motion of a search that meets its limits also between the samples."""

from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.design.excitation import SEARCHED_HZ, SMALL_SIZES, Design, resting
from scenarios.design.search import Found, Searchable
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory

APART = 0.01
"""Smallest cost difference of stored motions: 1 % of a standard deviation. Closer motions usually fail together."""

LEAST_SIZES = (0.3, 0.25, 0.2, 0.15, 0.1)
"""Factors for a motion that can be scaled only about one of its positions."""
QUICKEST = 1.5
"""Highest harmonic of an accelerated motion [Hz]: position loops of arms follow it, and filters of logs pass it."""


def with_better(kept: Sequence[Found], found: Found) -> tuple[Found, ...]:
    """Return the stored motions, best last, with a new one if it is better."""
    if not kept:
        return (found,)
    if found.cost >= kept[-1].cost:
        return tuple(kept)
    crowded = len(kept) > 1 and kept[-2].cost - kept[-1].cost < APART
    return (*(kept[:-1] if crowded else kept), found)


def best_fitted(design: Design, series: Searchable, kept: Sequence[Found]) -> tuple[FourierTrajectory, str]:
    """Return the best motion of a search if a reduction by 10 % is enough, otherwise the best alternative.

    Alternatives are the same motion with a smaller amplitude, or an earlier one. Also returned is why it is not the
    best, or an empty text. `kept` has at least one motion, the best last.

    Raises:
        TrajectoryError: If none can be scaled to the limits; the message states the violation of the best.
    """
    best = series.motion(kept[-1].x)
    try:
        return design.fitted(best), ""
    except TrajectoryError as error:
        reason = str(error)
    others = _shrunk(design, best)
    others += _earlier(design, series, kept[:-1], min(map(design.cost, others), default=float("inf")))
    if not others:
        raise TrajectoryError(f"no motion found can be scaled to the robot's limits; the best one: {reason}")
    return min(others, key=design.cost), reason


def first_fitted(design: Design, series: Searchable, searches: Iterable[Sequence[Found]]) -> FourierTrajectory:
    """Return the best motion of the first search for which a reduction by 10 % is enough, or the best alternative.

    Searches are started only as needed.

    Raises:
        TrajectoryError: If none can be scaled to the limits; the message states the violation of the best of the last
            search.
    """
    reason, motions = "", list[FourierTrajectory]()
    for kept in searches:
        try:
            motion, why = best_fitted(design, series, kept)
        except TrajectoryError as error:
            reason = str(error)
            continue
        if not why:
            return motion
        motions.append(motion)
    if not motions:
        raise TrajectoryError(reason)
    return min(motions, key=design.cost)


def quickened(design: Design, motion: FourierTrajectory) -> FourierTrajectory:
    """Return the motion, or the same path repeated faster within the period, whichever is more accurate.

    Ranges and distances limit a search in few slow harmonics, far below the rated speeds of the joints.
    """
    best = motion
    for times in range(2, int(QUICKEST * motion.duration / motion.sine.shape[1]) + 1):
        quick = _repeated(motion, times)
        if not design.keeps_limits(quick):
            break
        best = min(best, quick, key=design.cost)
    return best


def _repeated(motion: FourierTrajectory, times: int) -> FourierTrajectory:
    """Return the path of a motion repeated within its period: harmonic k becomes harmonic `times` k."""
    sine, cosine = (np.zeros((motion.n, times * motion.sine.shape[1])) for _ in range(2))
    sine[:, times - 1 :: times], cosine[:, times - 1 :: times] = motion.sine, motion.cosine
    return FourierTrajectory(motion.center, sine, cosine, motion.duration)


def _shrunk(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    try:
        return [design.fitted(motion, SMALL_SIZES)]
    except TrajectoryError:
        return []


def about_a_pose(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    """Return the motion scaled about the middle of its feasible positions; empty if there are none."""
    sampled = design.rows(motion, SEARCHED_HZ).motion[0]
    held = [q for q in sampled if not design.excess(design.rows(resting(q), 1.0)).any()]
    if not held:
        return []
    pose = held[len(held) // 2]
    for size in (*SMALL_SIZES, *LEAST_SIZES):
        center = pose + size * (motion.center - pose)
        smaller = FourierTrajectory(center, size * motion.sine, size * motion.cosine, motion.duration)
        try:
            return [design.fitted(smaller, np.ones(1))]
        except TrajectoryError:
            continue
    return []


def _earlier(design: Design, series: Searchable, kept: Sequence[Found], cost: float) -> list[FourierTrajectory]:
    """Return the best of these motions that can be scaled to the limits, if there is one below a cost."""
    for found in reversed(kept):
        if found.cost >= cost:
            break
        try:
            return [design.fitted(series.motion(found.x))]
        except TrajectoryError:
            continue
    return []
