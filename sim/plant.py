"""The plant: everything that is true of the simulated robot, and that identification must not see."""

from dataclasses import dataclass, field
from pathlib import Path

from sim.drives import DriveTruth
from sim.effects import EFFECTS, ModelErrors
from sim.errors import DriveError, PayloadBodyError
from sim.robot import Robot

HEAVIEST, FARTHEST, BULKIEST = 1e5, 1e2, 1e6
"""Largest mass [kg], distance of its centre [m] and moment of inertia [kg m^2] of a payload."""

Layout = tuple[Path, str | None, tuple[bool, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBody:
    """A rigid body on the flange, in the frame of the last link.

    Attributes:
        mass: [kg].
        com: Centre of mass [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass [kg m^2].

    Raises:
        PayloadBodyError: If a number is not finite or beyond any robot.
    """

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]

    def __post_init__(self) -> None:
        """Check the numbers; whether a body can have them is for the model's compiler to say."""
        if not 0.0 < self.mass <= HEAVIEST:
            raise PayloadBodyError(f"payload: mass = {self.mass:g} kg: expected more than 0 to {HEAVIEST:g}")
        for name, unit, most in (("com", "m", FARTHEST), ("inertia", "kg m^2", BULKIEST)):
            for value in getattr(self, name):
                if not abs(value) <= most:  # NaN is not
                    raise PayloadBodyError(f"payload: {name} {value:g} {unit}: expected {most:g} at most")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """The whole truth of one robot.

    Attributes:
        robot: The arm, and what is its alone.
        drives: Its drives as they are; the robot's own are nominal.
        payload: What the loaded motions carry.
        errors: What it has and the identification model has not.

    Raises:
        DriveError: If the drives are of another arm.
        EffectError: If robot or drives have no place for a model error.
    """

    robot: Robot
    drives: DriveTruth
    payload: PayloadBody
    errors: ModelErrors = field(default_factory=ModelErrors)

    def __post_init__(self) -> None:
        """Check that drives and errors fit the robot."""
        if len(self.drives.gain) != self.robot.n:
            raise DriveError(
                f"drives: {len(self.drives.gain)} gains for {self.robot.name}, which has {self.robot.n} joints"
            )
        for effect in EFFECTS.values():
            effect.fits(self.errors, self.robot, self.drives)


def layout(plant: Plant) -> Layout:
    """Plants of equal layout have compiled models of equal sizes, and may run in one batch."""
    robot = plant.robot
    return robot.model, robot.flange, tuple(effect.resizes(plant.errors) for effect in EFFECTS.values())
