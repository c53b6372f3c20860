"""A robot: the model of its arm, and what the model file cannot hold.

Nothing here is one robot's. A value that an arm does not have (a spring, a coupled motor, a frame by the name of d3) is
absent, and the model error that needs it is refused by name.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.errors import RobotError


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """A motor that turns with the sum of two joints; joints count from 0.

    Attributes:
        motor: The joint whose drive it is.
        turns_with: The other joint.
        viscous_friction: Of the motor, where it turns with the sum [N m s/rad].
        coulomb_friction: The same [N m].
    """

    motor: int
    turns_with: int
    viscous_friction: float
    coulomb_friction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GravitySpring:
    """Where a spring that helps a joint against gravity is hooked.

    Attributes:
        joint: Joint that it helps, from 0; there is one behind it.
        free_length: Length without force [m].
        radius: Distance of its near end, on the link before, from the joint's axis [m].
        distance: Distance of its far end, on the joint's own link, from the axis [m].
    """

    joint: int
    free_length: float
    radius: float
    distance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """An arm of n joints; arrays have shape (n,).

    Units are those of revolute joints; on a prismatic one they are N, m and kg in place of N m, rad and kg m^2.

    Attributes:
        name: As scenarios call it.
        model: Model file of the arm; bodies and joints from base to flange.
        drives: Its nominal drives.
        max_velocity: [rad/s].
        max_acceleration: [rad/s^2].
        home: Positions that the search for a motion starts from [rad].
        frames: Bodies by the name of the distance, drawn in the model, that leads to them.
        couplings: Motors that turn with the sum of two joints.
        gravity_spring: None for an arm without.
        flange: Last body of the arm in a model file that has more; joints that do not lead to it are held where they
            are drawn. None where all joints are the arm's.
        rated_load: Mass that it may carry [kg], None if nobody says.

    Raises:
        RobotError: If arrays do not fit each other, or a joint does not exist.
    """

    name: str
    model: Path
    drives: DriveTruth
    max_velocity: Array
    max_acceleration: Array
    home: Array
    frames: Mapping[str, str]
    couplings: tuple[Coupling, ...] = ()
    gravity_spring: GravitySpring | None = None
    flange: str | None = None
    rated_load: float | None = None

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.drives.gain)

    def __post_init__(self) -> None:
        """Check that the parts are of one arm."""
        for name in ("max_velocity", "max_acceleration", "home"):
            if len(getattr(self, name)) != self.n:
                raise RobotError(
                    f"robot {self.name}: {name}: {len(getattr(self, name))} values, but drives.gain has {self.n}; "
                    "expected one per joint"
                )
        for coupling in self.couplings:
            pair = (coupling.motor, coupling.turns_with)
            if not all(0 <= joint < self.n for joint in pair) or pair[0] == pair[1]:
                raise RobotError(
                    f"robot {self.name}: coupling of motor {pair[0] + 1} with joint {pair[1] + 1}: expected two of its "
                    f"{self.n} joints"
                )
        motors = [coupling.motor for coupling in self.couplings]
        if len(set(motors)) < len(motors):
            raise RobotError(
                f"robot {self.name}: coupling: a motor is named twice; each can be coupled to one other joint only"
            )
        if self.gravity_spring is not None and not 0 <= self.gravity_spring.joint < self.n - 1:
            raise RobotError(
                f"robot {self.name}: gravity_spring acts on joint {self.gravity_spring.joint + 1}: "
                f"expected one of its first {self.n - 1} joints"
            )
