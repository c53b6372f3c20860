"""Elastic joints: drives act on motor joints, which transmissions connect to the joints of the arm.

A transmission is a fixed tendon q_motor - q_link with stiffness and damping.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect, Values, tendons_ending
from sim.errors import EffectError
from sim.robot import Robot

TRANSMISSION = "_transmission"
"""Ending of the name of an elastic joint's tendon."""
TRANSMISSION_DAMPING = 0.05
"""Damping ratio of an elastic transmission on its rotor; assumed."""
FASTEST_MODE = 4.0 * TRANSMISSION_DAMPING
"""Largest natural frequency of rotor on transmission, times the physics step [rad].

Stiffness Ke acts explicitly, damping De implicitly, so a link of any inertia is stable if Ke step^2 <= 2 De step. With
`De = 2 zeta sqrt(Ke Ia)` this is `sqrt(Ke / Ia) step <= 4 zeta`.
"""
SOFTEST = 0.1
"""Largest compliance [rad/(N m)]: one radian under 10 N m."""
MASSLESS = 1e-12
"""Mass [kg] and inertia [kg m^2] of a motor's body, positive as MuJoCo requires; the armature is the rotor."""
SAG_ITERATIONS = 20
"""Number of iterations; each multiplies the error by gravity's over the transmission's stiffness, about 0.03."""


@dataclass(frozen=True, kw_only=True)
class JointElasticity(Values):
    """Elastic transmissions.

    Attributes:
        joint_compliance: Compliance of each joint's transmission [rad/(N m)]; None or all zero for rigid joints.
    """

    joint_compliance: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the compliances; replace all zero by None."""
        super().__post_init__()
        if self.joint_compliance is None:
            return
        if not any(self.joint_compliance):
            object.__setattr__(self, "joint_compliance", None)
        elif not all(0.0 < c <= SOFTEST for c in self.joint_compliance):
            raise EffectError(
                f"errors: joint_compliance = {list(self.joint_compliance)} rad/(N m): expected positive numbers up to "
                f"{SOFTEST:g}, one per joint; all zero for rigid joints"
            )


def _fits(values: JointElasticity, robot: Robot, drives: DriveTruth) -> None:
    compliance = values.joint_compliance
    if compliance is None:
        return
    if len(compliance) != robot.n:
        raise EffectError(
            f"errors: joint_compliance: {len(compliance)} values [rad/(N m)], expected {robot.n}, one per joint"
        )
    if not drives.rotor_inertia.all():
        raise EffectError("errors: joint_compliance needs a rotor_inertia above 0 kg m^2 at every joint")


def _add_motors(values: JointElasticity, spec: mujoco.MjSpec, build: Build) -> None:
    if values.joint_compliance is None:
        return
    stiffness, inertia = 1.0 / np.array(values.joint_compliance), np.asarray(build.drives.rotor_inertia)
    _refuse_stiff(stiffness, inertia, build.step)
    damping = 2.0 * TRANSMISSION_DAMPING * np.sqrt(stiffness * inertia)
    # Motors beside the arm are separate islands; solving them together with the arm changes the last digits.
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    links = [joint.name for joint in spec.joints]
    pairs = [(coupling.motor, coupling.turns_with) for coupling in build.robot.couplings]
    motors: list[mujoco.MjsBody] = []
    for j, link in enumerate(links):
        # MuJoCo's inertia matrix has entries only within one branch, but a coupling needs one between its two motors.
        parent = motors[-1] if any(min(pair) < j <= max(pair) for pair in pairs) else spec.worldbody
        motor = parent.add_body(name=f"{link}_motor", explicitinertial=True, mass=MASSLESS, inertia=[MASSLESS] * 3)
        motor.add_joint(name=motor.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        motors.append(motor)
        tendon = spec.add_tendon(name=f"{link}{TRANSMISSION}", springlength=[0.0, 0.0])
        tendon.stiffness[0], tendon.damping[0] = stiffness[j], damping[j]
        tendon.wrap_joint(motor.name, 1.0)
        tendon.wrap_joint(link, -1.0)
        spec.actuators[j].target = motor.name


def _refuse_stiff(stiffness: Array, inertia: Array, step: float) -> None:
    mode = np.sqrt(stiffness / inertia)  # (n,) rad/s
    j = int(np.argmax(mode))
    if mode[j] * step > FASTEST_MODE:
        softest, longest = (
            1.01 * step**2 / (FASTEST_MODE**2 * inertia[j]),
            0.99 * FASTEST_MODE / mode[j],
        )  # to be rounded
        raise EffectError(
            f"errors: joint_compliance of joint {j + 1} = {1.0 / stiffness[j]:.3g} rad/(N m) is too stiff for a step "
            f"of {step:g} s; use a step of {longest:.3g} s at most, or {softest:.3g} rad/(N m) at least"
        )


def transmissions(model: mujoco.MjModel) -> slice:
    """Return the slice of the tendons of elastic joints in a compiled model; empty without any."""
    return tendons_ending(model, TRANSMISSION)


def _settle(values: JointElasticity, model: mujoco.MjModel, state: Array) -> None:
    if values.joint_compliance is None:
        return
    n = len(values.joint_compliance)
    state[:n] = state[n:]
    sag(model, state)


def sag(model: mujoco.MjModel, state: Array) -> None:
    """Move the links to the equilibrium of transmission and gravity."""
    n, compliance, data = model.nu, 1.0 / model.tendon_stiffness[transmissions(model)], mujoco.MjData(model)
    for _ in range(SAG_ITERATIONS):
        data.qpos[:] = state
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        state[:n] += compliance * (data.qfrc_passive - data.qfrc_bias)[:n]


EFFECT = Effect[JointElasticity](
    fits=_fits, resizes=lambda values: values.joint_compliance is not None, before_compile=_add_motors, settle=_settle
)
