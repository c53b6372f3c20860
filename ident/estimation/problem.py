"""Input of an estimator: the arm's structure, the motions with their payloads, and options."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

from annotated_types import Interval

from ident.estimation.intervals import UNCERTAINTIES
from ident.model.structure import Structure
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.errors import NotIdentifiable, OptionError
from ident.support.options import NAMES, refuse_outside, unknown_name


@dataclass(frozen=True, slots=True, kw_only=True)
class GainOptions:
    """Required accuracy of a gain, and estimation of its uncertainty.

    Attributes:
        max_rel_std: Largest predicted relative standard deviation of a gain that is not refused.
        noise_floor: Residual that any real drive has, as a share of the joint's rms current. A prediction never
            assumes less, so that a simulation without noise does not make a joint look identifiable.
        rank_tol: Smallest relative singular value of the scaled observation matrix.
        uncertainty: Method that estimates the covariance.
    """

    max_rel_std: Annotated[float, Interval(gt=0.0, le=1e6)] = 0.1
    noise_floor: Annotated[float, Interval(ge=0.0, le=1e3)] = 0.05
    rank_tol: Annotated[float, Interval(gt=0.0, lt=1.0)] = 1e-7
    uncertainty: str = field(default="cautious", metadata={NAMES: UNCERTAINTIES})

    def __post_init__(self) -> None:
        """Check the values; raises `OptionError`."""
        refuse_outside(self, OptionError)
        if self.uncertainty not in UNCERTAINTIES:
            raise unknown_name("uncertainty", self.uncertainty, UNCERTAINTIES)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoOptions:
    """Options of a method that has none of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class ObservedMotion:
    """One motion: its linear system and its payload."""

    observation: Observation  # its linear system
    # the specified payload, None for a bare flange; Motions with one mounting share the object; two equal objects are
    # two mountings, each with its own unknown parameters:
    payload: Payload | None


def mounted(motions: Sequence[ObservedMotion]) -> tuple[Payload, ...]:
    """Return the payload of each mounting, in the order of their first motions."""
    return tuple({id(motion.payload): motion.payload for motion in motions if motion.payload is not None}.values())


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """One or more motions of one arm, bare and loaded in any order, from which gains are identified."""

    structure: Structure
    motions: tuple[ObservedMotion, ...]
    options: GainOptions

    def check_difference(self) -> None:
        """Raise `NotIdentifiable` if no motion is bare, or none is loaded."""
        bare = [motion.payload is None for motion in self.motions]
        if all(bare):
            raise NotIdentifiable("no motion carries a payload; without one the gains are known up to a common factor")
        if not any(bare):
            raise NotIdentifiable("no motion is bare; record one without payload")

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The payload of each mounting, in the order of their first motions."""
        return mounted(self.motions)

    @property
    def row_period(self) -> float:
        """Time from one row to the next [s]."""
        return self.motions[0].observation.joints[0].row_period


def pair(unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions) -> Problem:
    """Return the problem of one bare and one loaded motion."""
    return Problem(loaded.structure, (ObservedMotion(unloaded, None), ObservedMotion(loaded, payload)), options)
