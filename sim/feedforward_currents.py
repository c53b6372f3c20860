"""The currents that keep a plant exactly on its reference motion, as logged with perfect control.

    tau = inverse dynamics + friction - other torque,       v = v0 + (tau + Fcoff) / g

There is no time stepping. MuJoCo's inverse dynamics of the compiled model without friction gives the torque of links,
rotors and springs, including all effects that change the model; it is evaluated at a few samples and interpolated by
splines. A joint without a drive (a link behind its transmission) moves such that its torque balance is zero: it is
repeatedly displaced by its torque over its stiffness, and for a mass on springs its inertia, by frequency. Effects that
act in every control period are evaluated with the same `term` as in the closed loop, and the temperature of the drives
follows from their currents. These currents also show whether the drives can follow a motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np

from ident.numerics.splines import CubicSpline
from ident.support.arrays import Array, Indices
from sim.controller import inertias, inverse_dynamics
from sim.effects import EFFECTS, ModelErrors, Temperature
from sim.effects.effect import ControlStep
from sim.effects.motors import warming
from sim.effects.transmissions import own_stiffness, places_of_motors
from sim.engine import Varied, acting, varies
from sim.errors import PlantError, SimulationError
from sim.experiment import Experiment, after_warm_up, saturation, starts_warm, warming_motion, warmth_before
from sim.model_spec import arm_joints, driven_joints, file_stamp, silenced
from sim.plant import PayloadBody, Plant, plant_model
from sim.trajectory import FourierTrajectory

SETTLED = 1e-10
"""Change in an iteration, relative to the largest current, at which the iteration ends."""
MOTIONS_KEPT, PLANTS_KEPT, TABLES_KEPT = 4, 128, 64
"""Cached motions (20 s at 1 kHz take 4 MB), plants (50 kB; a search uses few for many motions) and tables (0.25 MB)."""
NOT_MOUNTED = PayloadBody(mass=1.0, com=(0.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
"""Placeholder for a payload that is not mounted: plants that differ only in it are equal."""
RATE = 100.0
"""Sampling rate [Hz] of a check of limits; ten samples are the largest time at a limit."""
SAMPLES_PER_HARMONIC, INERTIAS_PER_HARMONIC = 20, 10
"""Samples of torque (splines between) and of inertia (lines between) per period of a motion's highest harmonic."""
PERIODIC = 30
"""Samples of the periods before and after: the effect of a spline's ends falls to 27 % from one knot to the next."""


class States(NamedTuple):
    """A reference motion: times [s], (N,); positions, velocities and accelerations [rad, rad/s, rad/s^2], (N, n)."""

    t: Array
    q: Array
    dq: Array
    ddq: Array


@dataclass(frozen=True, slots=True)
class _Frictionless:
    """A compiled model without drives and friction; two are equal if their bytes are."""

    saved: bytes
    model: mujoco.MjModel = field(compare=False, repr=False)


def feedforward_currents(experiments: Sequence[Experiment], rate_hz: float) -> list[Array]:
    """Return the currents that the motions of experiments need [drive units], each (N, n), at the times of `states_of`.

    Experiments are as for `sim.record.record`, controller and sensors are ignored. Raises `PlantError` if a plant
    cannot be compiled, a motion passes through backlash, or friction is not below the torque of a drive.
    """
    found, ended = list[Array](), dict[int, Array | SimulationError]()
    for i, experiment in enumerate(experiments):
        before = np.zeros(experiment.plant.robot.n)
        if starts_warm(experiment):
            motion = warming_motion(experiment)
            for share in (0.5, 1.0):
                before = after_warm_up(motion, _feedforward(motion, rate_hz, before)[0], share)
        elif (carried := warmth_before(experiments, i, ended)) is not None:
            if isinstance(carried, SimulationError):
                raise carried
            before = carried
        v, ended[i] = _feedforward(experiment, rate_hz, before)
        found.append(v)
    return found


def check_torque_limits(experiments: Sequence[Experiment]) -> None:
    """Refuse motions that keep a drive of an arm without model errors at its limit for too long."""
    sound = [replace(e, plant=replace(e.plant, errors=ModelErrors())) for e in experiments]
    for e, v in zip(sound, feedforward_currents(sound, RATE), strict=True):
        if (saturated := saturation(e, _rubbing_of(e)[0].model, v, RATE)) is not None:
            raise saturated


@lru_cache(maxsize=MOTIONS_KEPT)
def states_of(motion: FourierTrajectory, rate_hz: float) -> States:
    """A reference motion, sampled from its start to its end."""
    t = np.arange(round(motion.duration * rate_hz) + 1) / rate_hz
    return States(t, *motion(t))


def of_motors(states: States, A: Array | None) -> States:
    """Return the motion of the motors from that of the joints, with the matrix `Robot.motors`."""
    return states if A is None else States(states.t, *(x @ A.T for x in states[1:]))


def inertia_along(experiment: Experiment, rate_hz: float) -> Array:
    """Inertia matrix of a rigid arm by its motors, with rotors, along the motion [kg m^2], shape (N, n, n)."""
    model, motion = _rubbing_of(experiment)[0].model, experiment.trajectory
    count = INERTIAS_PER_HARMONIC * motion.sine.shape[1]
    own, links = driven_joints(model), arm_joints(model)
    coarse = motion.duration / count * np.arange(count + 1)
    q = np.zeros((count + 1, model.nq))
    q[:, links] = q[:, own] = motion(coarse)[0]
    M = inertias(model, q)
    found = M[:, links, links] if own == links else M[:, links, links] + M[:, own, own]
    places = np.interp(states_of(motion, rate_hz).t, coarse, np.arange(count + 1.0))
    below = np.minimum(places.astype(np.intp), count - 1)
    share = (places - below)[:, None, None]
    M = (1.0 - share) * found[below] + share * found[below + 1]
    if (A := experiment.plant.robot.motors) is None:
        return M
    through = np.linalg.inv(A)
    return through.T @ M @ through


def _feedforward(experiment: Experiment, rate_hz: float, warmth: Array) -> tuple[Array, Array]:
    """Return the currents of a motion [drive units], (N, n), and the final temperature rise of the drives [K], (n,)."""
    found = _settled(*_rubbing_of(experiment), experiment.trajectory, rate_hz, tuple(warmth.tolist()))
    if found is None:
        raise PlantError(
            f"{experiment.name}: no current moves the arm: load-dependent friction equals or exceeds the drive torque"
        )
    return found


def _rubbing_of(experiment: Experiment) -> tuple[_Frictionless, Varied]:
    """Return the plant of an experiment without friction, and its friction; an unmounted payload has no effect."""
    plant = experiment.plant if experiment.loaded else replace(experiment.plant, payload=NOT_MOUNTED)
    return _rubbing(plant, experiment.loaded, experiment.step, experiment.earlier, file_stamp(plant.robot.model))


@lru_cache(maxsize=PLANTS_KEPT)
def _rubbing(plant: Plant, loaded: bool, step: float, earlier: int, stamp: int) -> tuple[_Frictionless, Varied]:
    model = plant_model(plant, loaded=loaded, step=step, earlier=earlier)
    acts = acting(plant, model, step=step, earlier=earlier)
    model.dof_frictionloss[:] = model.tendon_frictionloss[:] = 0.0
    for kind, place in places_of_motors(model):
        getattr(model, f"{kind}_damping")[place] = 0.0
    model.actuator_gainprm[:] = model.actuator_biasprm[:] = 0.0
    saved = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, saved)
    return _Frictionless(saved.tobytes(), model), acts


@lru_cache(maxsize=TABLES_KEPT)
def _settled(
    frictionless: _Frictionless, acts: Varied, motion: FourierTrajectory, rate_hz: float, warmth: tuple[float, ...]
) -> tuple[Array, Array] | None:
    """As `_feedforward`, None if friction prevents any motion; equal plants share the result."""
    errors, drives, states = acts.errors, acts.build.drives, states_of(motion, rate_hz)
    rigid = _torque_along(frictionless, motion, rate_hz)
    if (A := acts.build.robot.motors) is not None:  # of the motors
        rigid = np.asarray(np.linalg.solve(A.T, rigid.T).T, np.float64)
        states = of_motors(states, A)
    beside = _beside(acts, states, rigid)
    v, before, cold = np.zeros_like(rigid), np.full_like(rigid, np.inf), np.array(warmth)
    steady = not varies(errors)  # nothing then depends on the current
    warms = Temperature.varies(errors)

    def warmed(v: Array) -> Array:
        return warming(errors, cold, (v / drives.current_limit) ** 2 if warms else np.zeros_like(v), 1.0 / rate_hz)

    for _ in range(100):  # friction depends on the current
        warm = warmed(v)[:-1] if warms else np.zeros_like(v)
        tau = rigid + beside(v, warm)
        v = drives.amplifier_offset + (tau + drives.coulomb_asymmetry) / drives.gain
        if steady or np.abs(v - before).max() <= SETTLED * np.abs(v).max():
            v.flags.writeable = False
            return v, warmed(v)[-1] if warms else cold
        before = v
    return None


def _beside(acts: Varied, states: States, rigid: Array) -> Callable[[Array, Array], Array]:
    """Return the torque of friction and other effects [N m], (N, n), as a function of currents and temperature rise.

    `rigid` is the torque of links and rotors.
    """
    speed = states.dq @ acts.turns.T  # (N, n + c)
    rotors = (acts.inertia * (states.ddq @ acts.turns.T)) @ acts.turns
    transmitted = rigid - rotors
    friction, damping = (np.tile(each, (len(speed), 1)) for each in (acts.constant, acts.damping))
    active = [effect for effect in EFFECTS.values() if effect.varies(acts.errors)]
    own = [acts.errors], [acts.build]
    along = [effect.term(*own) if effect.instant else effect.along(acts.errors, acts.build) for effect in active]
    whole = [term for term in along if term is not None]
    fields = ("q", "dq", "v", "speed", "friction", "damping", "torque", "transmitted", "warmth")

    def torque(v: Array, warmth: Array) -> Array:
        step = ControlStep(
            period=float(states.t[1]),
            q=states.q,
            dq=states.dq,
            v=v,
            speed=speed,
            friction=friction.copy(),
            damping=damping.copy(),
            torque=np.zeros_like(v),
            turns=acts.turns[None],
            transmitted=transmitted,
            warmth=warmth.copy(),
        )
        steps, terms = iter([step]), whole
        if len(whole) < len(active):  # as views, for effects with memory
            terms = [effect.term(*own) for effect in active]
            steps = (replace(step, **{name: getattr(step, name)[k : k + 1] for name in fields}) for k in range(len(v)))
        for moment in steps:
            for add in terms:
                add(moment)
        return (step.friction * np.sign(speed) + step.damping * speed) @ acts.turns - step.torque

    return torque


@lru_cache(maxsize=TABLES_KEPT)
def _torque_along(rigid: _Frictionless, motion: FourierTrajectory, rate_hz: float) -> Array:
    """Return the torque without friction [N m], shape (N, n); plants that differ only in friction share it."""
    model, t = rigid.model, states_of(motion, rate_hz).t
    count = min(SAMPLES_PER_HARMONIC * motion.sine.shape[1], len(t) - 1)
    coarse = motion.duration / count * np.arange(count + 1)
    torque = _yielding(model, [x[:-1] for x in motion(coarse)], motion.duration)
    beyond = np.arange(-PERIODIC, count + PERIODIC + 1)
    periodic = torque.take(beyond, axis=0, mode="wrap")
    return CubicSpline.through(motion.duration / count * beyond, periodic)(t % motion.duration)


def _yielding(model: mujoco.MjModel, driven: list[Array], duration: float) -> Array:
    """Return the torque on the driven joints if those without a drive are in equilibrium, shape (samples, n)."""
    own = driven_joints(model)
    free = np.delete(np.arange(model.nv), own)
    states = [np.zeros((len(x), model.nv)) for x in driven]
    for all_joints, x in zip(states, driven, strict=True):
        all_joints[:, own] = x
    if not len(free):
        return inverse_dynamics(model, *states)
    if np.ptp(model.tendon_lengthspring, axis=1).any():
        raise PlantError(
            "joints are inside their backlash gaps, where no current holds a position; simulate the motion instead"
        )
    q, torque = states[0], states[0]
    rate = 2j * np.pi / duration * np.arange(len(q) // 2 + 1)[:, None]
    carried = np.where(model.jnt_stiffness > 0.0, model.body_subtreemass[model.jnt_bodyid], 0.0)  # none by links
    opposed = (own_stiffness(model) + rate * model.dof_damping + rate**2 * carried)[:, free]  # torque per displacement
    upright = _upright(model, q, free)
    change = np.inf
    for _ in range(5):  # after the first, the error falls by the load's stiffness over the spring's each time
        before, torque = torque, inverse_dynamics(model, *states)
        change = float(np.abs((torque - before)[:, own]).max())
        x, f = (np.fft.rfft((upright @ each[:, free, None])[:, :, 0], axis=0) for each in (q, torque))
        moved = np.fft.irfft(x - f / opposed, len(q), axis=0)
        q[:, free] = (upright.transpose(0, 2, 1) @ moved[:, :, None])[:, :, 0]
        spectrum = np.fft.rfft(q[:, free], axis=0)
        for k in (1, 2):
            states[k][:, free] = np.fft.irfft(rate**k * spectrum, len(q), axis=0)
    if not change <= 0.01 * np.abs(torque[:, own]).max():
        raise PlantError(
            "what yields on springs is near its resonance, where the currents of perfect control are not found; "
            "simulate the motion instead, or use a stiffer spring"
        )
    return torque[:, own]


@silenced()
def _upright(model: mujoco.MjModel, q: Array, free: Indices) -> Array:
    """Return the matrices from free joints to directions that do not turn, for springs of a body, (samples, f, f)."""
    data, found = mujoco.MjData(model), np.tile(np.eye(len(free)), (len(q), 1, 1))
    springs = np.flatnonzero(model.jnt_stiffness[free] > 0.0)[::3]
    for row, each in zip(found, q, strict=True):
        data.qpos[:] = each
        mujoco.mj_kinematics(model, data)
        for k in springs:
            row[k : k + 3, k : k + 3] = data.xmat[model.jnt_bodyid[free[k]]].reshape(3, 3)
    return found
