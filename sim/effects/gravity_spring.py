"""A gravity spring: a spatial tendon between the link before a joint and the one that the joint moves."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect, Values
from sim.errors import EffectError
from sim.robot import Robot


@dataclass(frozen=True, kw_only=True)
class GravitySpringErrors(Values):
    """Stiffness of the gravity spring that the robot file defines.

    Attributes:
        gravity_spring: Stiffness of a spring that supports the robot's joint against gravity [N/m].
    """

    gravity_spring: Annotated[float, Interval(ge=0.0, le=1e6), Unit("N/m")] = 0.0


def _has_spring(values: GravitySpringErrors, robot: Robot, drives: DriveTruth) -> None:
    if values.gravity_spring and robot.gravity_spring is None:
        raise EffectError(
            f"errors: gravity_spring = {values.gravity_spring:g} N/m: {robot.name} has no gravity spring; leave it at 0"
        )


def _hook_spring(values: GravitySpringErrors, spec: mujoco.MjSpec, build: Build) -> None:
    """Attach the spring above the joint's axis and to the far end of the joint's link.

    The torque depends only on the angle between both ends, so the ends may be exchanged.
    """
    spring = build.robot.gravity_spring
    if not values.gravity_spring or spring is None:
        return
    link, beyond = spec.joints[spring.joint].parent, spec.joints[spring.joint + 1].parent
    length = float(np.linalg.norm(beyond.pos))
    if not length:
        raise EffectError(
            f"errors: gravity_spring: {link.name} has zero length, so no spring can be attached; leave it at 0"
        )
    along = beyond.pos / length  # of the link, in its own frame
    upright = np.empty(3)
    mujoco.mju_rotVecQuat(upright, along, link.quat / np.linalg.norm(link.quat))
    link.parent.add_site(name="spring_near", pos=link.pos + spring.radius * upright)
    link.add_site(name="spring_far", pos=spring.distance * along)
    tendon = spec.add_tendon(name="gravity_spring", springlength=[spring.free_length] * 2)
    tendon.stiffness[0] = values.gravity_spring
    tendon.wrap_site("spring_near")
    tendon.wrap_site("spring_far")


EFFECT = Effect[GravitySpringErrors](
    fits=_has_spring, resizes=lambda values: values.gravity_spring > 0.0, before_compile=_hook_spring
)
