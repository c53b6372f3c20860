"""Input of an estimator: the arm's structure, the motions with their payloads, and options."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.estimation.gain_options import GainOptions
from ident.model.structure import Structure
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable


@dataclass(frozen=True, slots=True, eq=False)
class ObservedMotion:
    """One motion: its linear system and its payload.

    Attributes:
        observation: Its linear system.
        payload: The specified payload, None for a bare flange. Motions with one mounting share the object; two equal
            objects are two mountings, each with its own unknown parameters.
    """

    observation: Observation
    payload: Payload | None


def mounted(motions: Sequence[ObservedMotion]) -> tuple[Payload, ...]:
    """Return the payload of each mounting, in the order of their first motions."""
    return tuple({id(motion.payload): motion.payload for motion in motions if motion.payload is not None}.values())


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Motions of one arm, bare and loaded, from which gains are identified.

    Attributes:
        structure: Identifiable structure of the arm.
        motions: One or more, bare and loaded in any order.
        options: When a gain counts as identifiable, and how its uncertainty is estimated.
    """

    structure: Structure
    motions: tuple[ObservedMotion, ...]
    options: GainOptions

    def check_difference(self) -> None:
        """Check that there are bare and loaded motions.

        Raises:
            NotIdentifiable: If no motion is bare, or none is loaded.
        """
        if all(motion.payload is None for motion in self.motions):
            raise NotIdentifiable("no motion carries a payload; without one the gains are known up to a common factor")
        if all(motion.payload is not None for motion in self.motions):
            raise NotIdentifiable("no motion is bare; record one without payload")

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The payload of each mounting, in the order of their first motions."""
        return mounted(self.motions)

    @property
    def row_period(self) -> float:
        """Time from one row to the next [s]."""
        return self.motions[0].observation.joints[0].row_period

    def joint_name(self, joint: int) -> str:
        """Name of a joint, from 0."""
        return self.structure.arm.joint_names[joint]


def pair(unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions) -> Problem:
    """Return the problem of one bare and one loaded motion."""
    return Problem(loaded.structure, (ObservedMotion(unloaded, None), ObservedMotion(loaded, payload)), options)
