"""What the robot of a scenario logged, and the same as identification is given it."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import grouped
from sim.drives import DriveTruth


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """What the robot of one setup logged.

    Attributes:
        setup: Nothing random left in it.
        recordings: Of the motions, in order of time.
        simulate_s: Wall time, its share of the batch [s].
        check: Of the motion that identification does not see, None where there is none.
    """

    setup: Setup
    recordings: tuple[Recording, ...]
    simulate_s: float
    check: Recording | None = None

    @property
    def logs(self) -> tuple[Motion, ...]:
        """The motions as identification is given them, each with the payload that it is believed to carry."""
        return as_identified(self.setup, self.recordings)

    @property
    def truth(self) -> DriveTruth:
        """The drives as they are: `truth.gain` [N m / drive unit], shape (n,), and what they lose."""
        return self.setup.plant.drives


def as_identified(setup: Setup, recordings: Sequence[Recording]) -> tuple[Motion, ...]:
    """The motions of a scenario in the order that identification is given them, each with what it carries.

    Args:
        setup: The scenario's.
        recordings: Of its motions, in order of time.
    """
    return tuple(Motion(recordings[k], setup.mounted[k]) for k in grouped(setup.protocol))
