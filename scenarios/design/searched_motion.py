"""Initial motions and results of searches: a scenario's own motion, and motion files with their provenance."""

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
    """The best motion of a stopped search, and its number of motions."""

    motion: FourierTrajectory
    tried: int


def own_motion(scenario: Scenario, design: Design) -> FourierTrajectory | None:
    """Return the motion of a scenario; None if there is none that this robot can carry out."""
    try:
        motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    except ScenarioError:
        return None
    return motion if motion.n == design.problem.plant.robot.n and design.keeps_limits(motion) else None


def first_motion(scenario: Scenario, series: Series) -> FourierTrajectory:
    """Return the motion of a scenario as the start of a search.

    Raises:
        ScenarioError: If the parametrisation cannot represent the motion; if there is none.
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
    """Return predicted standard deviations of gains, shape (n,), as text in percent; a dash if not identifiable."""
    return ", ".join(f"{100.0 * std:.2g}" if isfinite(std) else "-" for std in deviations)


def search_comments(command: str, deviations: Array, *, tried: int, wanted: int) -> list[str]:
    """Return the head of a motion file: provenance and predicted accuracy.

    The command excludes the name of the file; `deviations` are the predicted relative ones of all gains, shape (n,).
    """
    stopped = f"Stopped after {tried} of {wanted} motions; repeat the command to continue."
    return [
        f"{FOUND_BY}{command} --out FILE",
        *[stopped] * (tried < wanted),
        f"Predicted standard deviation of the gains [%], joints 1 to {len(deviations)}: {percents(deviations)}",
        f"(for a residual of {100.0 * RESIDUAL:g} % of each joint's rms torque at {ROWS_PER_SECOND:g} rows per second)",
    ]


def unfinished(path: Path, command: str) -> Unfinished | None:
    """Return the stopped search of a motion file; None if there is none, or if it has another command.

    Raises:
        ScenarioError: If the file is not a motion.
    """
    if not path.is_file():
        return None
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    stopped = next((match for match in map(STOPPED.match, lines) if match), None)
    if stopped is None or f"# {FOUND_BY}{command} --out FILE" not in lines:
        return None
    return Unfinished(read_motion(path.name, path.parent), tried=int(stopped[1]))
