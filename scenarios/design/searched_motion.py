"""Motions that a search is begun with or leaves: a scenario's own, and files that say how their motion was found."""

import re
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from ident.support.arrays import Array
from scenarios.design.excitation import Design
from scenarios.design.search import Series
from scenarios.experiments.files.motions import read_motion
from scenarios.experiments.files.schema import Scenario
from scenarios.prediction.deviations import RESIDUAL, ROWS_PER_SECOND
from scenarios.support.errors import ScenarioError
from sim.trajectory import FourierTrajectory

FOUND_BY = "Found by: "
STOPPED = re.compile(r"# Stopped after (\d+) of \d+ motions")


class Unfinished(NamedTuple):
    """The best motion of a search that was stopped, and how many motions it tried."""

    motion: FourierTrajectory
    tried: int


def own_motion(scenario: Scenario, design: Design) -> FourierTrajectory | None:
    """The motion of a scenario; None where there is none yet, or none that this robot can make."""
    try:
        motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    except ScenarioError:
        return None
    return motion if motion.n == design.problem.plant.robot.n and design.keeps_limits(motion) else None


def first_motion(scenario: Scenario, series: Series) -> FourierTrajectory:
    """The motion of a scenario, for a search to begin with.

    Raises:
        ScenarioError: If no point of the series is that motion; if there is none.
    """
    motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    n, harmonics = motion.sine.shape
    if n != series.n or harmonics > series.harmonics or motion.duration != series.duration:
        raise ScenarioError(
            f"{scenario.name}: motion {scenario.table.experiment.motion!r} has {harmonics} harmonics of {n} joints in "
            f"{motion.duration:g} s; to improve it, search with --duration {motion.duration:g} and --harmonics "
            f"{harmonics} or more, on an arm of {n} joints"
        )
    return motion


def percents(deviations: Array) -> str:
    """Predicted deviations of all gains, shape (n,), in percent and in words; a dash where a motion cannot show one."""
    return ", ".join(f"{100.0 * std:.2g}" if isfinite(std) else "-" for std in deviations)


def search_comments(command: str, deviations: Array, *, tried: int, wanted: int) -> list[str]:
    """What stands above a motion in its file: how it was found, and what it predicts.

    The command is without the name of the file; `deviations` are predicted, relative, of all gains, shape (n,).
    """
    stopped = f"Stopped after {tried} of {wanted} motions; repeat the command to continue."
    return [
        f"{FOUND_BY}{command} --out FILE",
        *[stopped] * (tried < wanted),
        f"Predicted standard deviation of the gains [%], joints 1 to {len(deviations)}: {percents(deviations)}",
        f"(for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque at {ROWS_PER_SECOND:g} rows per second)",
    ]


def unfinished(path: Path, command: str) -> Unfinished | None:
    """The search in a motion file that was stopped; None if there is none, or another command's.

    Raises:
        ScenarioError: If the file holds no motion.
    """
    if not path.is_file():
        return None
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    stopped = next((match for match in map(STOPPED.match, lines) if match), None)
    if stopped is None or f"# {FOUND_BY}{command} --out FILE" not in lines:
        return None
    return Unfinished(read_motion(path.name, path.parent), tried=int(stopped[1]))
