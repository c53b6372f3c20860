"""Of the motions that a search found one after another, the best that keeps its limits between the samples too."""

from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.design.excitation import SEARCHED_HZ, SMALL_SIZES, Design, resting
from scenarios.design.search import Found, Searchable
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory

APART = 0.01
"""Costs of motions that are kept differ by so much: a deviation by 1 %. Nearer ones fail together."""

LEAST_SIZES = (0.3, 0.25, 0.2, 0.15, 0.1)
"""Of a motion that can be shrunk about one of its positions only."""
QUICKEST = 1.5
"""Fastest harmonic of a quickened motion [Hz]: position loops of arms follow it, and filters of logs keep it."""


def with_better(kept: Sequence[Found], found: Found) -> tuple[Found, ...]:
    """Motions that are kept, best last, with another one; the same if that is no better."""
    if not kept:
        return (found,)
    if found.cost >= kept[-1].cost:
        return tuple(kept)
    crowded = len(kept) > 1 and kept[-2].cost - kept[-1].cost < APART
    return (*(kept[:-1] if crowded else kept), found)


def best_fitted(design: Design, series: Searchable, kept: Sequence[Found]) -> tuple[FourierTrajectory, str]:
    """The best motion of a search, if a tenth less of it is enough; else the best of what else can be fitted.

    That is the same motion, shrunk farther, or an earlier one. With it, why it is not the best; empty if it is. Motions
    are `kept` best last, one at least.

    Raises:
        TrajectoryError: If none can be fitted; says what is wrong with the best.
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
    """The best motion of the first search whose best is fitted by a tenth less; if there is none, of what else can be.

    No search is begun that is not needed.

    Raises:
        TrajectoryError: If nothing can be fitted; says what is wrong with the best of the last search.
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
    """The motion, or the same path at a multiple of its pace and as often in its period, whatever shows the gains best.

    A search in few slow harmonics ends where ranges and distances do, far below the speed that joints have.
    """
    best = motion
    for times in range(2, int(QUICKEST * motion.duration / motion.sine.shape[1]) + 1):
        quick = _repeated(motion, times)
        if not design.keeps_limits(quick):
            break
        best = min(best, quick, key=design.cost)
    return best


def _repeated(motion: FourierTrajectory, times: int) -> FourierTrajectory:
    """The path of a motion several times in its period: harmonic k becomes harmonic `times` k."""
    sine, cosine = (np.zeros((motion.n, times * motion.sine.shape[1])) for _ in range(2))
    sine[:, times - 1 :: times], cosine[:, times - 1 :: times] = motion.sine, motion.cosine
    return FourierTrajectory(motion.center, sine, cosine, motion.duration)


def _shrunk(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    try:
        return [design.fitted(motion, SMALL_SIZES)]
    except TrajectoryError:
        return []


def about_a_pose(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    """The motion shrunk about the middle one of its positions that can be held; empty if none can."""
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
    """The best of these motions that can be fitted, if there is one below a cost."""
    for found in reversed(kept):
        if found.cost >= cost:
            break
        try:
            return [design.fitted(series.motion(found.x))]
        except TrajectoryError:
            continue
    return []
