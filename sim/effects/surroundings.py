"""What yields beyond the drives, on springs that are equally stiff in all directions: payload and table.

    k = m (2 pi f)^2,    d = 2 D m 2 pi f

    loose payload    m is the mass of a share of the payload, a point at its centre of mass; a liquid is such a share
    table            m is the mass of base and links, without a payload

They yield along gravity at rest, which changes no static torque, and are in equilibrium at the start of a motion.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.effects.effect import Build, Effect, Share
from sim.errors import PlantError
from sim.model_spec import SUPPORT

LOOSE = "loose payload"
"""Name of the body on springs in that of the payload."""
SPECK = 1e-6
"""Mass [kg] and inertia [kg m^2] where there is none: a body that moves has some."""
Hertz = Annotated[float, Interval(gt=0.0, le=50.0), Unit("Hz")]
Ratio = Annotated[float, Interval(ge=0.0, le=2.0)]


@dataclass(frozen=True, kw_only=True)
class LoosePayload(Effect):
    """A share of every payload that moves on springs: a payload that is loose on its mount, or a liquid in it."""

    adds: ClassVar[bool] = True
    loose_share: Share = 0.0  # share of the payload's mass that moves relative to the flange
    loose_hz: Hertz = 5.0  # its natural frequency, with the flange at rest [Hz]
    loose_damping: Ratio = 0.05  # its damping ratio; assumed

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        if self.loose_share:
            payload = spec.body("payload")
            mass = max(self.loose_share * payload.mass, SPECK)  # a bare flange has the joints too
            payload.mass *= 1.0 - self.loose_share
            _add_slides(_add_point(payload, LOOSE, np.nan_to_num(payload.ipos), mass), LOOSE)

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        if self.loose_share:
            _add_springs(model, LOOSE, model.body(LOOSE).mass[0], self.loose_hz, self.loose_damping)


@dataclass(frozen=True, kw_only=True)
class SoftTable(Effect):
    """A table, or a frame, that yields under the arm; it does not tilt, and has no mass of its own.

    Attributes:
        table_hz: Natural frequency of the bare arm on the table, with its joints locked [Hz]; 0 for a rigid one.
        table_damping: Its damping ratio; assumed.
    """

    adds: ClassVar[bool] = True
    table_hz: Annotated[float, Interval(ge=0.0, le=50.0), Unit("Hz")] = 0.0
    table_damping: Ratio = 0.05

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        if not self.table_hz:
            return
        base = spec.joints[0].parent
        while base.parent is not spec.worldbody and base.parent.name != "world":
            base = base.parent
        if base.joints:
            raise PlantError(
                f"errors: table_hz = {self.table_hz:g} Hz: the first joint of {build.robot.model} is on body "
                f"{base.name!r} without a base; wrap it in a body for the base, or leave table_hz at 0"
            )
        _add_point(base, SUPPORT, np.zeros(3), SPECK)  # a base may have no mass
        _add_slides(base, SUPPORT)

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        if self.table_hz:
            base = model.body(model.jnt_bodyid[0])
            mass = base.subtreemass[0] - model.body("payload").subtreemass[0]
            _add_springs(model, SUPPORT, mass, self.table_hz, self.table_damping)


def _add_point(body: mujoco.MjsBody, name: str, place: Array, mass: float) -> mujoco.MjsBody:
    return body.add_body(name=name, pos=place, explicitinertial=True, mass=mass, ipos=np.zeros(3), inertia=[SPECK] * 3)


def _add_slides(body: mujoco.MjsBody, name: str) -> None:
    for axis, letter in zip(np.eye(3), "xyz", strict=True):
        body.add_joint(name=f"{name} {letter}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)


def _add_springs(model: mujoco.MjModel, name: str, mass: float, hz: float, damping: float) -> None:
    places = [model.joint(f"{name} {letter}").id for letter in "xyz"]
    rate = 2.0 * np.pi * hz
    model.jnt_stiffness[places], model.dof_damping[places] = mass * rate**2, 2.0 * damping * mass * rate
