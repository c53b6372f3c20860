"""An independent simulator: currents by Pinocchio's inverse dynamics along a prescribed motion, no controller.

The links move as prescribed, q_l(t). Their torque is tau_l = RNEA(q_l, dq_l, ddq_l) with the payload as a body; behind
a transmission of stiffness K the motor stands at q = q_l + tau_l / K, and gives

    tau = tau_l + Ia ddq + Fc (1 + s exp(-(dq / 0.1)^2)) sign(dq) + Fv dq + l |tau| sign(dq),        v = tau / g + v0

of which q and v are logged. A prescribed motion makes this exact for elastic joints too.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pinocchio as pin
from diagnosis_arms import ARMS, BuiltArm
from scipy import interpolate, ndimage, signal

from ident.model.arm import arm_from_pinocchio
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Known, Payload
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array

VERSION = 3
"""Of this file and of the arms, one more where logs change."""
STRIBECK_SPEED, REVERSAL = 0.1, 2e-3
"""Speeds at which Stribeck friction falls, and dry friction turns over [rad/s]."""
MASS_STD, COM_STD, INERTIA_STD = 0.002, 5e-4, 0.03
"""Of payloads as stated and drawn: share of the mass, [m], share of the moments."""
Reference = Callable[[Array], tuple[Array, Array, Array]]


@dataclass(frozen=True, kw_only=True)
class Condition:
    """What is done with an arm, and what it has that the model lacks.

    Attributes:
        rate: Samples a second [Hz].
        seconds: Length of each log [s].
        jitter: Of the stamps, honest ones, as a share of the interval.
        fastest: Highest frequency of the motion [Hz].
        targets: Whether joints go to random targets, instead of along sines.
        repeated: Whether all logs are of one motion.
        loaded: Whether the payload is mounted, log by log.
        known: Of the payload.
        white: White noise of the current, as a share of its rms.
        coloured: The same below 5 Hz.
        quantum: Of the encoder [rad or m].
        stribeck: Extra dry friction near standstill, as a share.
        load_friction: Dry friction per unit of motor torque.
        drift: Deviation of the logarithm of friction from log to log, joint by joint.
        by_direction: Difference of dry friction between both directions, as a share.
        elastic: Natural frequency of rotors on their transmissions [Hz], None if rigid.
    """

    rate: float = 250.0
    seconds: float = 20.0
    jitter: float = 0.0
    fastest: float = 0.45
    targets: bool = False
    repeated: bool = True
    loaded: tuple[bool, ...] = (False, True)
    known: Known = "all"
    white: float = 0.03
    coloured: float = 0.01
    quantum: float = 1e-5
    stribeck: float = 0.0
    load_friction: float = 0.0
    drift: float = 0.0
    by_direction: float = 0.0
    elastic: float | None = None


CONDITIONS: dict[str, Condition] = {
    "mild": Condition(),
    "targets": Condition(targets=True),
    "two motions": Condition(repeated=False),
    "three logs": Condition(loaded=(False, True, False), repeated=False, targets=True, drift=0.03),
    "mass only": Condition(known="mass"),
    "mass only, two motions": Condition(known="mass", repeated=False, rate=500.0),
    "noise 5 %": Condition(white=0.05, coloured=0.03),
    "coarse encoder 0.2 mrad": Condition(quantum=2e-4, rate=500.0),
    "coarse encoder 1 mrad": Condition(quantum=1e-3),
    "125 Hz": Condition(rate=125.0, white=0.02),
    "1000 Hz": Condition(rate=1000.0, quantum=1e-6),
    "jittered stamps": Condition(rate=125.0, jitter=0.25),
    "slow": Condition(fastest=0.15, seconds=40.0),
    "short": Condition(seconds=10.0, rate=500.0),
    "stribeck": Condition(stribeck=0.4),
    "load friction 5 %": Condition(load_friction=0.05),
    "load friction 15 %": Condition(load_friction=0.15),
    "drift 5 %": Condition(drift=0.05),
    "drift 20 %": Condition(drift=0.2, repeated=False),
    "by direction": Condition(by_direction=0.3),
    "elastic 25 Hz": Condition(elastic=25.0),
    "elastic 15 Hz": Condition(elastic=15.0),
    "all together": Condition(
        repeated=False, stribeck=0.2, load_friction=0.04, drift=0.05, by_direction=0.15, elastic=22.0, coloured=0.02
    ),
}
SEVERAL = ("mild", "targets", "two motions")
"""Conditions with more than one seed."""


@dataclass(frozen=True, kw_only=True)
class Drives:
    """True drives of an arm, n of each: gains, rotors [kg m^2 or kg], friction, current without torque."""

    gain: Array
    rotor: Array
    coulomb: Array
    viscous: Array
    offset: Array


@lru_cache(maxsize=32)
def built(arm: str) -> BuiltArm:
    return ARMS[arm]()


@lru_cache(maxsize=32)
def structure(arm: str) -> Structure:
    return structure_of(arm_from_pinocchio(built(arm).model))


def sines(rng: np.random.Generator, middle: Array, spread: Array, fastest: float) -> Reference:
    """Sums of seven sines a joint at frequencies that share no period."""
    n, parts = len(middle), 7
    w = 2.0 * np.pi * fastest * rng.uniform(0.15, 1.0, (n, parts))
    size = rng.uniform(0.4, 1.0, (n, parts))
    a = spread[:, None] * size / np.linalg.norm(size, axis=1, keepdims=True) * 0.8
    phase = rng.uniform(-np.pi, np.pi, (n, parts))

    def motion(t: Array) -> tuple[Array, Array, Array]:
        angle = w * t[:, None, None] + phase
        q = middle + (a * np.sin(angle)).sum(axis=2)
        return q, (a * w * np.cos(angle)).sum(axis=2), -(a * w**2 * np.sin(angle)).sum(axis=2)

    return motion


def targets(rng: np.random.Generator, middle: Array, spread: Array, seconds: float) -> Reference:
    """Each joint to random targets, one after 1.2 to 3.5 s, smoothed."""
    grid = np.arange(-2.0, seconds + 2.0, 0.01)
    q = np.empty((len(grid), len(middle)))
    for j in range(len(middle)):
        changes = np.cumsum(rng.uniform(1.2, 3.5, round(seconds) + 4)) - 2.0
        levels = middle[j] + spread[j] * rng.uniform(-1.0, 1.0, len(changes) + 1)
        q[:, j] = ndimage.gaussian_filter1d(levels[np.searchsorted(changes, grid)], 30.0)
    curve = interpolate.make_interp_spline(grid, q, k=5)
    return lambda t: (curve(t), curve(t, nu=1), curve(t, nu=2))


def rigid_torque(model: pin.Model, q: Array, dq: Array, ddq: Array) -> Array:
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])


def with_payload(model: pin.Model, payload: Payload) -> pin.Model:
    assert payload.com is not None
    assert payload.inertia is not None
    ixx, iyy, izz, ixy, ixz, iyz = payload.inertia
    about = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    heavy = model.copy()
    body = pin.Inertia(payload.mass, np.array(payload.com), about)
    heavy.appendBodyToJoint(model.nv, body, pin.SE3.Identity())
    return heavy


@lru_cache(maxsize=32)
def drives(arm: str) -> Drives:
    """Drives that suit what the bare arm needs along a motion of its own."""
    each = built(arm)
    rng = np.random.default_rng((6011, *arm.encode()))
    n = each.model.nv
    q, dq, ddq = sines(rng, each.middle, each.spread, 0.4)(np.arange(0.0, 30.0, 0.1))
    rms = np.sqrt(np.mean(rigid_torque(each.model, q, dq, ddq) ** 2, axis=0))
    scale = rms + 0.08 * rms.max() * np.where(structure(arm).arm.revolute, 1.0, 0.3)
    mass = np.diag(pin.crba(each.model, each.model.createData(), each.middle))
    mass = mass + 0.4 * each.mass * each.reach**2 * structure(arm).arm.revolute  # rotors that suit the load too
    return Drives(
        gain=np.round(scale * rng.uniform(0.35, 0.8, n), 3) * np.where(rng.random(n) < 0.3, -1.0, 1.0),
        rotor=mass * rng.uniform(0.15, 0.6, n),
        coulomb=scale * rng.uniform(0.1, 0.3, n),
        viscous=scale * rng.uniform(0.08, 0.25, n) / np.sqrt(np.mean(dq**2, axis=0)),
        offset=rng.uniform(-0.1, 0.1, n),
    )


def payloads(arm: str, known: Known, rng: np.random.Generator) -> tuple[Payload, Payload]:
    """A payload as weighed and drawn, and as it is: off by what is stated."""
    each = built(arm)
    side = rng.standard_normal(3) * (1.0, 1.0, 0.6)
    com = each.reach * side / np.linalg.norm(side)
    moments = each.mass * each.reach**2 * rng.uniform(0.12, 0.2, 3)
    mass_std, moment_std = MASS_STD * each.mass, INERTIA_STD * moments
    believed = Payload(
        mass=each.mass, mass_std=mass_std, com=tuple(com.tolist()), com_std=(COM_STD,) * 3,
        inertia=(*moments.tolist(), 0.0, 0.0, 0.0), inertia_std=(*moment_std.tolist(), 0.0, 0.0, 0.0), known=known,
    )  # fmt: skip
    true_com = com + COM_STD * rng.standard_normal(3)
    true_moments = moments + moment_std * np.clip(rng.standard_normal(3), -2.0, 2.0)
    return believed, Payload(
        mass=each.mass + mass_std * rng.standard_normal(),
        com=tuple(true_com.tolist()),
        inertia=(*true_moments.tolist(), 0.0, 0.0, 0.0),
    )


def currents(tau_l: Array, dq: Array, ddq: Array, of: Drives, friction: Array, condition: Condition) -> Array:
    """Currents that carry the links' torque, friction and rotors."""
    side = np.tanh(dq / REVERSAL)
    dry = of.coulomb * (1.0 + condition.stribeck * np.exp(-((dq / STRIBECK_SPEED) ** 2)))
    dry = dry * (1.0 + 0.5 * condition.by_direction * side)
    tau = tau_l + of.rotor * ddq + friction * (dry * side + of.viscous * dq)
    tau = tau / (1.0 - condition.load_friction * side * np.sign(tau))
    return tau / of.gain + of.offset


def noise(v: Array, condition: Condition, rng: np.random.Generator) -> Array:
    rms = np.sqrt(np.mean(v**2, axis=0))
    sos = signal.butter(2, 5.0, fs=condition.rate, output="sos")
    slow = signal.sosfilt(sos, rng.standard_normal((len(v) + 500, v.shape[1])), axis=0)[500:]
    slow /= np.sqrt(np.mean(slow**2, axis=0))
    return rms * (condition.white * rng.standard_normal(v.shape) + condition.coloured * slow)


def simulated(arm: str, name: str, seed: int) -> tuple[Motion, ...]:
    """Logs of an arm under the condition of that name; the same arguments give the same numbers."""
    each, of, condition = built(arm), drives(arm), CONDITIONS[name]
    rng = np.random.default_rng((9001, seed, *arm.encode(), 0, *name.encode()))
    believed, true = payloads(arm, condition.known, rng)
    heavy = with_payload(each.model, true)

    def new_motion() -> Reference:
        if condition.targets:
            return targets(rng, each.middle, each.spread, condition.seconds)
        return sines(rng, each.middle, each.spread, condition.fastest)

    shared, friction, logs = new_motion(), np.ones(each.model.nv), []
    for k, loaded in enumerate(condition.loaded):
        motion = shared if condition.repeated or k == 0 else new_motion()
        t = np.arange(round(condition.seconds * condition.rate)) / condition.rate
        t = t + condition.jitter / condition.rate * np.clip(rng.standard_normal(len(t)), -1.5, 1.5) + 0.01
        q, dq, ddq = motion(t)
        tau_l = rigid_torque(heavy if loaded else each.model, q, dq, ddq)
        if condition.elastic is not None:
            curve = interpolate.make_interp_spline(t, tau_l / (of.rotor * (2.0 * np.pi * condition.elastic) ** 2), k=5)
            q, dq, ddq = q + curve(t), dq + curve(t, nu=1), ddq + curve(t, nu=2)
        v = currents(tau_l, dq, ddq, of, friction, condition)
        v = v + noise(v, condition, rng)
        friction = friction * np.exp(condition.drift * rng.standard_normal(each.model.nv))
        read = condition.quantum * np.round(q / condition.quantum)
        recording = Recording(t, read, v, f"{'loaded' if loaded else 'bare'}{k + 1}")
        logs.append(Motion(recording, believed if loaded else None))
    return tuple(logs)
