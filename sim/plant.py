"""The plant: everything that is true of the simulated robot, and that identification must not see."""

from dataclasses import dataclass, field

from sim.drives import DriveTruth
from sim.errors import DriveError, EffectError
from sim.model_errors import ModelErrors
from sim.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadBody:
    """A rigid body on the flange, in the frame of the last link.

    Attributes:
        mass: [kg].
        com: Centre of mass [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass [kg m^2].
    """

    mass: float
    com: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


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
        EffectError: If the robot has no place for a model error.
    """

    robot: Robot
    drives: DriveTruth
    payload: PayloadBody
    errors: ModelErrors = field(default_factory=ModelErrors)

    def __post_init__(self) -> None:
        """Check that drives and errors fit the robot."""
        compliance, n = self.errors.joint_compliance, len(self.drives.gain)
        if n != self.robot.n:
            raise DriveError(f"drives: {n} gains for {self.robot.name}, which has {self.robot.n} joints")
        if compliance is not None and len(compliance) != n:
            raise EffectError(
                f"errors: joint_compliance: {len(compliance)} values [rad/(N m)], expected {n}, one a joint"
            )
