"""Effects that change the arm before it is compiled: tilted base, shifted frames, zeros of joints, a gravity spring."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from sim.effects.effect import Build, Effect
from sim.errors import PlantError
from sim.robot import DriveTruth, Robot

LARGEST_ZERO = 0.5
"""Largest error of a zero [rad or m]."""
Tilt = Annotated[float, Interval(ge=-0.5, le=0.5), Unit("rad")]
Moved = Annotated[float, Interval(ge=-0.1, le=0.1), Unit("m")]


@dataclass(frozen=True, kw_only=True)
class BaseTilt(Effect):
    """Tilt of the base about its x axis, then about its rotated y axis: gravity is rotated by the inverse."""

    base_tilt_x: Tilt = 0.0  # tilt of the base about its x axis [rad]
    base_tilt_y: Tilt = 0.0  # tilt of the base about its y axis, applied after that about x [rad]

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        if not (self.base_tilt_x or self.base_tilt_y):
            return
        (cx, cy), (sx, sy) = (f([self.base_tilt_x, self.base_tilt_y]) for f in (np.cos, np.sin))
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
        about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
        spec.option.gravity = (about_x @ about_y).T @ spec.option.gravity


@dataclass(frozen=True, kw_only=True)
class MovedFrames(Effect):
    """Errors of distances between frames; the robot file names the frames."""

    d3_error: Moved = 0.0  # error of the distance from frame 2 to frame 3 [m]
    r4_error: Moved = 0.0  # error of the distance from frame 3 to frame 4 [m]

    @property
    def moved(self) -> dict[str, float]:
        """Return the nonzero errors of distances [m], by their names in the robot file."""
        return {name: error for name, error in (("d3", self.d3_error), ("r4", self.r4_error)) if error}

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        for name, error in self.moved.items():
            if name not in robot.frames:
                raise PlantError(f"errors: {name}_error = {error:g} m: {robot.name} has no frame {name}; leave it at 0")

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        for name, error in self.moved.items():
            stated, body = f"errors: {name}_error = {error:g} m", spec.body(build.robot.frames[name])
            if body is None:
                raise PlantError(f"{stated}: {build.robot.model} has no body {build.robot.frames[name]!r}")
            drawn = float(np.linalg.norm(body.pos))
            if not drawn or drawn + error <= 0.0:
                raise PlantError(f"{stated}: {body.name} is {drawn:g} m from its parent in the model; leave it at 0")
            body.pos = (1.0 + error / drawn) * body.pos


@dataclass(frozen=True, kw_only=True)
class ZeroErrors(Effect):
    """Errors of the joints' zeros: encoder readings are offset from the joint angles.

    Attributes:
        zero_error: Encoder reading of each joint at its true zero [rad, m for prismatic joints]; None for no error.
    """

    zero_error: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the errors."""
        super().__post_init__()
        if self.zero_error is not None and not all(abs(each) <= LARGEST_ZERO for each in self.zero_error):
            raise PlantError(
                f"errors: zero_error = {list(self.zero_error)} rad: expected numbers between {-LARGEST_ZERO:g} and "
                f"{LARGEST_ZERO:g}, one per joint"
            )

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.zero_error is not None and len(self.zero_error) != robot.n:
            raise PlantError(
                f"errors: zero_error: {len(self.zero_error)} values [rad], expected {robot.n}, one per joint"
            )

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        for joint, error in zip(spec.joints, self.zero_error or (), strict=False):
            in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
            joint.ref += float(np.degrees(error)) if in_degrees else error


@dataclass(frozen=True, kw_only=True)
class GravitySpringErrors(Effect):
    """The gravity spring that the robot file defines: a tendon between the link before a joint and the joint's own.

    Attributes:
        gravity_spring: Stiffness of a spring that supports the robot's joint against gravity [N/m].
    """

    adds: ClassVar[bool] = True
    gravity_spring: Annotated[float, Interval(ge=0.0, le=1e6), Unit("N/m")] = 0.0

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        if self.gravity_spring and robot.gravity_spring is None:
            raise PlantError(
                f"errors: gravity_spring = {self.gravity_spring:g} N/m: {robot.name} has no gravity spring; leave it "
                "at 0"
            )

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        """Attach the spring above the joint's axis and to the far end of its link; the ends may be exchanged."""
        spring = build.robot.gravity_spring
        if not self.gravity_spring or spring is None:
            return
        link, beyond = spec.joints[spring.joint].parent, spec.joints[spring.joint + 1].parent
        length = float(np.linalg.norm(beyond.pos))
        if not length:
            raise PlantError(
                f"errors: gravity_spring: {link.name} has zero length, so no spring can be attached; leave it at 0"
            )
        along = beyond.pos / length  # of the link, in its own frame
        upright = np.empty(3)
        mujoco.mju_rotVecQuat(upright, along, link.quat / np.linalg.norm(link.quat))
        link.parent.add_site(name="spring_near", pos=link.pos + spring.radius * upright)
        link.add_site(name="spring_far", pos=spring.distance * along)
        tendon = spec.add_tendon(name="gravity_spring", springlength=[spring.prestress / spring.stiffness] * 2)
        tendon.stiffness[0] = self.gravity_spring
        tendon.wrap_site("spring_near")
        tendon.wrap_site("spring_far")
