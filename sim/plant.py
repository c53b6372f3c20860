"""The plant: all true parameters of the simulated robot, which identification must not use."""

from dataclasses import dataclass, field
from pathlib import Path

from sim.effects import EFFECTS, ModelErrors
from sim.errors import PlantError
from sim.robot import DriveTruth, Robot

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
        PlantError: If a number is not finite or out of range.
    """

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]

    def __post_init__(self) -> None:
        """Check the numbers; MuJoCo's compiler checks whether they are physically possible."""
        if not 0.0 < self.mass <= HEAVIEST:
            raise PlantError(f"payload: mass = {self.mass:g} kg: expected more than 0 to {HEAVIEST:g}")
        for name, unit, most in (("com", "m", FARTHEST), ("inertia", "kg m^2", BULKIEST)):
            for value in getattr(self, name):
                if not abs(value) <= most:  # NaN is not
                    raise PlantError(f"payload: {name} {value:g} {unit}: expected {most:g} at most")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """All true parameters of one robot.

    Attributes:
        robot: The arm and its specific elements.
        drives: Its true drives; those of `robot` are nominal.
        payload: Payload of the loaded motions.
        errors: Effects that the identification model lacks.

    Raises:
        PlantError: If the drives do not match the arm, or a model error does not apply to robot or drives.
    """

    robot: Robot
    drives: DriveTruth
    payload: PayloadBody
    errors: ModelErrors = field(default_factory=ModelErrors)

    def __post_init__(self) -> None:
        """Check that drives and errors fit the robot."""
        if len(self.drives.gain) != self.robot.n:
            raise PlantError(
                f"drives: {len(self.drives.gain)} gains for {self.robot.name}, which has {self.robot.n} joints"
            )
        for effect in EFFECTS.values():
            effect.fits(self.errors, self.robot, self.drives)


def layout(plant: Plant) -> Layout:
    """Layout of the compiled model; plants of equal layout have models of equal sizes and may run in one batch."""
    robot = plant.robot
    return robot.model, robot.flange, tuple(effect.resizes(plant.errors) for effect in EFFECTS.values())
