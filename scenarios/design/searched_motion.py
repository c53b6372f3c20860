"""Motion files of searches: how the motion was found, what it predicts, and whether the search was stopped."""

import re
from dataclasses import dataclass
from pathlib import Path

from ident.support.arrays import Array
from scenarios.experiments.files.motions import read_motion, write_motion
from sim.trajectory import FourierTrajectory

FOUND_BY = "Found by: "
STOPPED = re.compile(r"# Stopped after (\d+) of \d+ motions")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SearchedMotion:
    """A motion and how it was found.

    Attributes:
        motion: The motion.
        command: The command that finds it, without the name of the file.
        tried: Motions that were tried.
        wanted: Motions that should be.
        deviations: Predicted relative standard deviations of all gains, shape (n,).
    """

    motion: FourierTrajectory
    command: str
    tried: int
    wanted: int
    deviations: Array

    @property
    def predicted(self) -> str:
        """The deviations in percent, in words."""
        return ", ".join(f"{100.0 * std:.2g}" for std in self.deviations)


def write_searched(found: SearchedMotion, path: Path, residual: float) -> None:
    """Write a motion with how it was found above it.

    Args:
        found: The motion.
        path: Where.
        residual: Share of each joint's rms torque that the prediction takes as residual.
    """
    comments = [f"{FOUND_BY}{found.command} --out FILE"]
    if found.tried < found.wanted:
        comments.append(f"Stopped after {found.tried} of {found.wanted} motions; repeat the command to continue.")
    comments += [
        f"Predicted standard deviation of the gains [%], joints 1 to {len(found.deviations)}: {found.predicted}",
        f"(for a residual of {100.0 * residual:g} % of each joint's rms torque at 20 rows per second)",
    ]
    write_motion(found.motion, path, comments)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Unfinished:
    """A search that was stopped.

    Attributes:
        motion: Its best motion.
        tried: Motions that it tried.
    """

    motion: FourierTrajectory
    tried: int


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
    return Unfinished(motion=read_motion(path.name, path.parent), tried=int(stopped[1]))
