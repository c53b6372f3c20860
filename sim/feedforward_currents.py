"""The currents that keep a plant exactly on its reference motion, as logged with perfect control.

There is no time stepping. MuJoCo's inverse dynamics of the compiled model gives the torque of links, rotors and
springs, including all effects that change the model. Effects that act in every control period are evaluated with the
same `term` as in the closed loop. Joints without a drive (links behind elastic transmissions) move such that their
torque balance is zero. The temperature of the drives follows from their currents. These currents also show whether the
drives can follow a motion.

    tau = inverse dynamics + friction - other torque, v = v0 + (tau + Fcoff) / g
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.support.arrays import Array
from sim.compile import bare_arm, lean_model
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import ControlStep
from sim.effects.temperature import varies as warmth_acts
from sim.effects.temperature import warming
from sim.errors import NoCurrent, Saturated, SimulationError
from sim.experiment import Experiment
from sim.faults import SATURATED_TOO_LONG, first_at_limit
from sim.model_spec import file_stamp
from sim.plant import PayloadBody, Plant
from sim.rigid import Frictionless, frictionless, inertias, torque_along
from sim.sequence import after_warm_up, starts_warm, warming_motion, warmth_before
from sim.trajectory import FourierTrajectory
from sim.varying import Varied, acting

FEEDBACK_ITERATIONS = 100
"""Largest number of iterations for friction that depends on the current."""
SETTLED = 1e-10
"""Change in an iteration, relative to the largest current, at which the iteration ends."""
MOTIONS_KEPT = 4
"""Number of cached sampled motions; one of 20 s at 1 kHz takes 4 MB."""
PLANTS_KEPT = 128
"""Number of cached compiled plants, 50 kB each: a search uses the same plants for thousands of motions."""
NOT_MOUNTED = PayloadBody(mass=1.0, com=(0.0, 0.0, 0.0), inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
"""Placeholder for a payload that is not mounted: plants that differ only in it are equal."""
TABLES_KEPT = 64
"""Number of cached tables of torques, and of currents; one of 20 s at 250 Hz takes 0.25 MB."""
RATE = 100.0
"""Sampling rate [Hz]; ten samples are the largest time at a limit."""


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """A reference motion, N samples of n joints.

    Attributes:
        t: [s], shape (N,).
        q: Positions [rad], shape (N, n).
        dq: Velocities [rad/s], shape (N, n).
        ddq: Accelerations [rad/s^2], shape (N, n).
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Feedforward:
    """Currents of a motion [drive units], shape (N, n), and final temperature rise of the drives [K], shape (n,)."""

    v: Array
    warmth: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Rubbing:
    """A compiled plant: its model without friction, and its friction."""

    rigid: Frictionless
    acts: Varied


def feedforward_currents(experiments: Sequence[Experiment], rate_hz: float) -> list[Array]:
    """Return the currents that the motions of experiments need.

    Args:
        experiments: In order of time for each robot, as for `sim.record.record`; controller and sensors are ignored.
        rate_hz: Samples a second [Hz].

    Returns:
        Currents of each experiment [drive units], shape (N, n), at the times of `states_of`.

    Raises:
        PlantError: If a plant cannot be compiled, or a motion passes through backlash.
        NoCurrent: If friction equals or exceeds the drive torque.
        SequenceError: If drives warm up and the preceding motion is missing.
    """
    found, ended = list[Array](), dict[int, Array | SimulationError]()
    for i, experiment in enumerate(experiments):
        before = _warmed_up(experiment, rate_hz) if starts_warm(experiment) else warmth_before(experiments, i, ended)
        assert not isinstance(before, SimulationError), "none is kept"
        result = _feedforward(experiment, rate_hz, np.zeros(experiment.plant.robot.n) if before is None else before)
        ended[i] = result.warmth
        found.append(result.v)
    return found


def _warmed_up(experiment: Experiment, rate_hz: float) -> Array:
    """Temperature rise after a warm-up [K], shape (n,), by the midpoint rule of `sim.sequence`."""
    motion, warmth = warming_motion(experiment), np.zeros(experiment.plant.robot.n)
    for share in (0.5, 1.0):
        warmth = after_warm_up(motion, _feedforward(motion, rate_hz, warmth).v, share)
    return warmth


def _feedforward(experiment: Experiment, rate_hz: float, warmth: Array) -> _Feedforward:
    found = _settled(_rubbing_of(experiment), experiment.trajectory, rate_hz, tuple(warmth.tolist()))
    if found is None:
        raise NoCurrent(
            f"{experiment.name}: no current moves the arm: load-dependent friction equals or exceeds the drive torque"
        )
    return found


@lru_cache(maxsize=TABLES_KEPT)
def _settled(
    rubbing: _Rubbing, motion: FourierTrajectory, rate_hz: float, warmth: tuple[float, ...]
) -> _Feedforward | None:
    """Currents of a plant along a motion, None if friction prevents any motion; equal plants share them."""
    errors, drives = rubbing.acts.errors, rubbing.acts.build.drives
    states = states_of(motion, rate_hz)
    rigid = _rigid(rubbing.rigid, motion, rate_hz)
    v, before, cold = np.zeros_like(rigid), np.full_like(rigid, np.inf), np.array(warmth)
    steady = not any(effect.varies(errors) for effect in EFFECTS.values())  # nothing then depends on the current

    def warmed(v: Array) -> Array:
        load = (v / drives.current_limit) ** 2 if warmth_acts(errors) else np.zeros_like(v)
        return warming(errors, cold, load, 1.0 / rate_hz)

    for _ in range(FEEDBACK_ITERATIONS):
        warm = warmed(v)[:-1] if warmth_acts(errors) else np.zeros_like(v)
        tau = rigid + _beside(rubbing.acts, states, v, rigid, warm)
        v = drives.amplifier_offset + (tau + drives.coulomb_asymmetry) / drives.gain
        if steady or np.abs(v - before).max() <= SETTLED * np.abs(v).max():
            v.flags.writeable = False
            return _Feedforward(v, warmed(v)[-1])
        before = v
    return None


@lru_cache(maxsize=MOTIONS_KEPT)
def states_of(motion: FourierTrajectory, rate_hz: float) -> States:
    """A reference motion, sampled from its start to its end."""
    t = np.arange(round(motion.duration * rate_hz) + 1) / rate_hz
    return States(t, *motion(t))


def inertia_along(experiment: Experiment, rate_hz: float) -> Array:
    """Inertia matrix of a rigid arm with its rotors along the motion [kg m^2], shape (N, n, n), at the same times."""
    return inertias(_rubbing_of(experiment).rigid, experiment.trajectory, states_of(experiment.trajectory, rate_hz).t)


def _beside(acts: Varied, states: States, v: Array, rigid: Array, warmth: Array) -> Array:
    """Return the torque of friction and of other effects on the joints [N m], shape (N, n).

    Args:
        acts: The effects.
        states: The motion.
        v: Currents of the motion [drive units], shape (N, n).
        rigid: Torque of links and rotors [N m], shape (N, n).
        warmth: Temperature rise of the drives [K], shape (N, n).
    """
    speed = states.dq @ acts.turns.T  # (N, n + c)
    rotors = (acts.inertia * (states.ddq @ acts.turns.T)) @ acts.turns
    step = ControlStep(
        t=0.0,
        period=float(states.t[1]),
        q=states.q,
        dq=states.dq,
        v=v,
        constant=np.broadcast_to(acts.constant, speed.shape),
        speed=speed,
        friction=np.tile(acts.constant, (len(speed), 1)),
        damping=np.tile(acts.damping, (len(speed), 1)),
        torque=np.zeros_like(v),
        turns=acts.turns[None],
        transmitted=rigid - rotors,
        warmth=warmth.copy(),
    )
    active = [effect for effect in EFFECTS.values() if effect.varies(acts.errors)]
    at_once = all(effect.instant or effect.along for effect in active)
    terms = [
        effect.along(acts.errors, acts.build) if at_once and effect.along else effect.term([acts.errors], [acts.build])
        for effect in active
    ]
    moments = [step] if at_once else _moments(step, states.t)
    for moment in moments:
        for add in terms:
            add(moment)
    return (step.friction * np.sign(speed) + step.damping * speed) @ acts.turns - step.torque


def _moments(step: ControlStep, t: Array) -> list[ControlStep]:
    """Yield the samples of a motion one by one, as views, for effects with memory."""
    fields = ("q", "dq", "v", "constant", "speed", "friction", "damping", "torque", "transmitted", "warmth")
    rows = ({name: getattr(step, name)[k : k + 1] for name in fields} for k in range(len(t)))
    return [replace(step, t=float(time), **row) for time, row in zip(t, rows, strict=True)]


def _rubbing_of(experiment: Experiment) -> _Rubbing:
    """Return the compiled plant of an experiment; a payload that is not mounted has no effect."""
    plant = experiment.plant if experiment.loaded else replace(experiment.plant, payload=NOT_MOUNTED)
    return _rubbing(plant, experiment.loaded, experiment.step, experiment.earlier, file_stamp(plant.robot.model))


@lru_cache(maxsize=PLANTS_KEPT)
def _rubbing(plant: Plant, loaded: bool, step: float, earlier: int, stamp: int) -> _Rubbing:
    model = lean_model(plant, loaded=loaded, step=step, earlier=earlier)
    acts = acting(plant, model, step=step, earlier=earlier)
    return _Rubbing(frictionless(model), acts)


@lru_cache(maxsize=TABLES_KEPT)
def _rigid(model: Frictionless, motion: FourierTrajectory, rate_hz: float) -> Array:
    """Return the torque without friction [N m], shape (N, n); plants that differ only in friction share it."""
    return torque_along(model, motion, states_of(motion, rate_hz).t)


def check_torque_limits(experiments: Sequence[Experiment]) -> None:
    """Check that no drive of an arm without model errors is at its current limit for too long.

    Raises:
        Saturated: If a drive is.
        PlantError: If a plant cannot be compiled.
    """
    sound = [replace(e, plant=replace(e.plant, errors=ModelErrors())) for e in experiments]
    for e, v in zip(experiments, feedforward_currents(sound, RATE), strict=True):
        drives, robot = e.plant.drives, e.plant.robot
        over = first_at_limit(v, drives.current_limit, RATE)
        if over is None:
            continue
        joint, since = over
        name = bare_arm(robot.model, drives.rotor_inertia, robot.flange).joint(joint).name
        most, limit = float(abs(v[:, joint]).max()), drives.current_limit[joint]
        raise Saturated(
            f"{e.name}: drive of {name} would need up to {most:.4g} where its limit is {limit:g}, for more than "
            f"{SATURATED_TOO_LONG:g} s from t = {since:.2f} s; "
            + ("use a lighter payload or a slower motion" if e.loaded else "use a slower motion")
        )
