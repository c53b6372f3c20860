"""Of the motions that a search found one after another, the best that keeps its limits between the samples too."""

from collections.abc import Iterable, Sequence

from scenarios.design.excitation import SMALL_SIZES, Design
from scenarios.design.search import Found, Searchable
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory

APART = 0.01
"""Costs of motions that are kept differ by so much: a deviation by 1 %. Nearer ones fail together."""


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

    That is the same motion, shrunk farther, or an earlier one. With it, why it is not the best; empty if it is.

    Args:
        design: The problem.
        series: Whose points were searched.
        kept: Motions of the search, best last, one at least.

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

    Args:
        design: The problem.
        series: Whose points were searched.
        searches: What each kept, best last; none is begun that is not needed.

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


def _shrunk(design: Design, motion: FourierTrajectory) -> list[FourierTrajectory]:
    try:
        return [design.fitted(motion, SMALL_SIZES)]
    except TrajectoryError:
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
