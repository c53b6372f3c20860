"""A robot from its model file: drives, home pose and first payload, each stated, or by one of ten defaults.

Defaults are a starting point: each is written into the user's file with its source, and should be replaced. Largest
torques, if not stated, are what random motions need; the first payload is a steel bar within the rated load and the
torques of the joints, so a weak arm gets a lighter one.
"""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ident.model.arm import Arm
from ident.payload.payload import Payload, read_payload
from ident.support.arrays import Array
from ident.support.errors import PayloadError
from scenarios.design.excitation import HALF_TURN
from scenarios.design.model_facts import ArmEnd, ModelFacts, arm_end, check_stated_numbers, model_facts
from scenarios.experiments.robots import read_arm
from scenarios.experiments.scenario import body_of
from sim.controller import inverse_dynamics
from sim.errors import RobotError
from sim.plant import PayloadBody, bare_arm
from sim.shapes import CLEARANCE


class Default(NamedTuple):
    """A default with its source, and a second number where there is one."""

    value: float
    source: str
    second: float = 0.0


DEFAULTS = {
    "speed": Default(2.0, "2 rad/s or 0.4 m/s", second=0.4),
    "acceleration": Default(4.0, "4 1/s times the largest speed; the RX-90's robot file has 3 to 6"),
    "torque": Default(2.0, "2 times what random motions need with a load of 10 % of the moving mass"),
    "load": Default(0.1, "10 % of the moving links' mass; data sheets state 8 to 30 %"),
    "rotor inertia": Default(0.0065, "0.0065 times the largest torque; the RX-90's has 0.005 to 0.0075"),
    "viscous friction": Default(10.0, "10 1/s times the rotor inertia; an identified TX-40 has 15 to 60"),
    "coulomb friction": Default(1.0, "1 rad/s or m/s times the viscous friction; an identified TX-40 has 0.9 to 3.2"),
    "offsets": Default(0.03, "3 % and 2 % of the Coulomb friction; an identified TX-40 has 5 % together", second=0.02),
    "resonance": Default(20.0, "rotor resonances on the transmissions at 20 to 30 Hz", second=30.0),
    "zeros": Default(0.00175, "0.1 degrees, 0.1 mm for a prismatic joint: a calibrated arm", second=0.0001),
}
"""All defaults, of which most are factors on other quantities. Second numbers are those of prismatic joints (speed,
zeros), of the amplifier offset beside the Coulomb asymmetry (offsets), and the upper end (resonance)."""
DENSITY = 7850.0
"""Density of steel [kg/m^3]."""
STATES, PACE = 200, 1.0 / 3.0
"""Number of random states for torques, and their speed and acceleration relative to the largest ones."""
LOADED, TORQUE_SHARE = 0.3, 0.75
"""Largest torque of the payload, and of arm and payload, as shares of a joint's; the search for a motion allows 0.8."""
CALMER = ((0.9, PACE), (0.6, 0.0), (0.3, 0.0), (0.1, 0.0))
"""Shares of random states that must be feasible, and their relative speeds, tried in this order for a weak arm."""
LEAST = 0.01
"""Smallest ratio of payload to moving mass before the next of these is tried."""
HEAVIEST = 10.0
"""Largest payload [kg]."""
CLEAR = 2.0 * CLEARANCE
"""Smallest distance of a clear home pose to floor and arm [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stated:
    """Numbers, shape (n,), with origin (a word per joint) and source (a sentence)."""

    value: Array
    origin: tuple[str, ...]
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Values stated in addition to the model file; None for defaults.

    Attributes:
        flange: Last body of the arm; joints outside the chain to it are locked.
        name: Name of the robot; default: that of the model.
        home: Start pose [rad or m].
        torque: Largest torques of the joints [N m or N].
        rated_load: Rated load [kg].
        payload: Payload file, or the mass of a bar [kg].
    """

    flange: str | None = None
    name: str | None = None
    home: Sequence[float] | None = None
    torque: Sequence[float] | None = None
    rated_load: float | None = None
    payload: Path | float | None = None


@dataclass(frozen=True, slots=True)
class Load:
    """The first payload, complete, with its source (a sentence) and a warning, empty if there is none."""

    payload: Payload
    source: str
    warning: str

    @property
    def body(self) -> PayloadBody:
        """The payload as a rigid body."""
        return body_of(self.payload)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewRobot:
    """A robot from its model file and defaults.

    Attributes:
        name: Name of the robot.
        path: Model file.
        model: Path of the model file in the robot file.
        end: Last body of the arm, and joints recognised as those of a gripper.
        arm: The arm.
        facts: Other data of the model file.
        rated_load: Rated load [kg], None if not stated.
        drives: Values by table of a robot file's `[drives]`.
        load: The first payload.
        home: Start pose of the search for a motion; zero until it is chosen.
        home_clearance: Smallest distance of the home pose to floor and arm [m], negative for an overlap.
        always_near: Pairs of links, or of link and payload, that are too near to each other at all positions.
    """

    name: str
    path: Path
    model: str
    end: ArmEnd
    arm: Arm
    facts: ModelFacts
    rated_load: float | None
    drives: Mapping[str, Stated]
    load: Load
    home: Stated
    home_clearance: float = 0.0
    always_near: tuple[tuple[str, str], ...] = ()


def described(path: Path, folder: Path, given: Given) -> NewRobot:
    """Read a model file, and complete it by defaults, except for the home pose.

    Raises:
        RobotModelError: If the file is not an arm.
        RobotError: If the number of torques is wrong, or joints are too weak.
        PayloadError: If the payload file is not valid.
        SimulationError: One of its kinds, if links lack an inertia.
    """
    end = ArmEnd(given.flange) if given.flange is not None else arm_end(path)
    arm = read_arm(path, (), flange=end.flange)
    check_stated_numbers(path, end.flange)
    facts = model_facts(path, end.flange)
    drives = drives_by_default(arm, path, end.flange, facts, given.torque)
    return NewRobot(
        name=given.name or re.sub(r"[^A-Za-z0-9_-]+", "-", arm.name).strip("-") or "robot",
        path=path,
        model=os.path.relpath(path.resolve(), folder.resolve()),
        end=end,
        arm=arm,
        facts=facts,
        rated_load=given.rated_load,
        drives=drives,
        load=first_load(arm, path, end.flange, drives, rated=given.rated_load, payload=given.payload),
        home=assumed(np.zeros(arm.n), "zero"),
    )


def assumed(value: Array, source: str) -> Stated:
    """Return assumed numbers."""
    return Stated(value, ("assumed",) * len(value), source)


def drives_by_default(
    arm: Arm, model: Path, flange: str | None, facts: ModelFacts, torque: Sequence[float] | None = None
) -> dict[str, Stated]:
    """Return the tables of a robot file's `[drives]`, by name; `torque` are stated largest ones [N m or N].

    Raises:
        RobotError: If the number of torques is wrong.
    """
    usual = DEFAULTS["speed"]

    def stated(values: Mapping[str, float], name: str, default: Array) -> Stated:
        """Return the values of the file, completed by a default."""
        value = [float(f"{values.get(joint, default[j]):.4g}") for j, joint in enumerate(arm.joint_names)]
        origin = tuple("published" if joint in values else "assumed" for joint in arm.joint_names)
        parts = [f"stated in {model.name}"] * ("published" in origin) + [DEFAULTS[name].source] * ("assumed" in origin)
        return Stated(np.array(value), origin, "; where it does not: ".join(parts))

    speed = stated(facts.velocity, "speed", np.where(arm.revolute, usual.value, usual.second))
    if torque is None:
        compiled = bare_arm(model, np.zeros(arm.n), flange)
        moving = float(compiled.body_subtreemass[compiled.jnt_bodyid[0]])
        load = bar(DEFAULTS["load"].value * moving, beside_the_axis(arm))
        need = np.abs(random_torques(arm, model, flange, speed.value, body_of(load))).max(axis=0)
        limit = stated(facts.torque, "torque", DEFAULTS["torque"].value * need)
    elif len(torque) != arm.n:
        raise RobotError(f"torque: {len(torque)} values, but the arm has {arm.n} joints: {', '.join(arm.joint_names)}")
    else:
        limit = assumed(np.array(torque), "the torques that rx90 new-robot was given")
    torques = limit.value

    def by(name: str, of: Array) -> Stated:
        return assumed(DEFAULTS[name].value * of, DEFAULTS[name].source)

    rotor = by("rotor inertia", torques)
    viscous = by("viscous friction", rotor.value)
    coulomb = by("coulomb friction", viscous.value)
    return {
        "gain": assumed(np.ones(arm.n), "a log of torques from the manufacturer's constants: 1 unit is 1 N m or 1 N"),
        "rotor_inertia": rotor,
        "viscous_friction": viscous,
        "coulomb_friction": coulomb,
        "coulomb_asymmetry": by("offsets", coulomb.value),
        "amplifier_offset": assumed(DEFAULTS["offsets"].second * coulomb.value, DEFAULTS["offsets"].source),
        "current_limit": Stated(torques, limit.origin, f"largest torque over gain; torque: {limit.source}"),
        "max_velocity": speed,
        "max_acceleration": by("acceleration", speed.value),
    }


def first_load(
    arm: Arm,
    model: Path,
    flange: str | None,
    drives: Mapping[str, Stated],
    *,
    rated: float | None = None,
    payload: Path | float | None = None,
) -> Load:
    """Return the payload of a first experiment: a given one, or a bar within rated load and joint torques.

    Args:
        arm: The arm.
        model: Its model file.
        flange: Last body of the arm, None if all joints belong to the arm.
        drives: Its drives.
        rated: Rated load [kg], None if not stated.
        payload: A payload file, or the mass of a bar [kg]; None for a bar that the arm can carry.

    Raises:
        RobotError: If the bare arm alone needs more than a joint's largest torque.
        PayloadError: If the file is not a complete payload.
    """
    compiled = bare_arm(model, np.zeros(arm.n), flange)
    own, moving = (float(compiled.body_subtreemass[compiled.jnt_bodyid[j]]) for j in (-1, 0))
    if payload is None:
        usual = DEFAULTS["load"].value * moving
        unrated = f"no rated load is specified, so at most the last link's own mass, {own:.2g} kg"
        if own < usual:
            unrated = f"no rated load is specified, so at most {usual:.2g} kg: {DEFAULTS['load'].source}"
        most, why = (max(own, usual), unrated) if rated is None else (rated, f"within the rated load of {rated:g} kg")
        mass, weakest = _can_carry(arm, model, flange, drives, min(most, HEAVIEST), moving)
        stated = bar(mass, beside_the_axis(arm))
        source = f"assumed: a steel bar of proportions 1 : 1 : 3 beside the axis of the last joint; {weakest or why}"
    elif isinstance(payload, Path):
        stated, source = read_payload(payload), f"as specified in {payload.name}"
        if stated.com is None or stated.inertia is None:
            raise PayloadError(f"{payload}: a simulation needs com and inertia of the payload; state both")
    else:
        stated = bar(payload, beside_the_axis(arm))
        source = "a steel bar of proportions 1 : 1 : 3 of the mass that was given"
    warning = ""
    if rated is not None and stated.mass > rated:
        warning = f"{stated.mass:g} kg is above the rated load, {rated:g} kg"
    elif rated is None and stated.mass > 1.005 * own:
        warning = (
            f"{stated.mass:g} kg is more than the last link's own {own:.2g} kg, and no rated load is specified: look "
            "it up in the data sheet and state it with --rated-load"
        )
    return Load(stated, source, warning)


def _can_carry(
    arm: Arm, model: Path, flange: str | None, drives: Mapping[str, Stated], most: float, moving: float
) -> tuple[float, str]:
    """Return the largest mass up to `most` within the joint torques [kg], and what limits it or an empty text."""
    torque, speed, com = drives["current_limit"].value, drives["max_velocity"].value, beside_the_axis(arm)
    need = room = np.zeros(arm.n)
    for share, pace in CALMER:
        bare, loaded = (
            random_torques(arm, model, flange, speed, load, pace=pace) for load in (None, body_of(bar(1.0, com)))
        )
        need, each = np.quantile(np.abs(bare), share, axis=0), np.abs(loaded - bare).max(axis=0)
        room = np.minimum(LOADED * torque, TORQUE_SHARE * torque - need)
        masses = room / np.maximum(each, 1e-9)
        mass = min(most, float(masses.min()))
        if mass >= min(most, LEAST * moving):
            digits = 10.0 ** (np.floor(np.log10(mass)) - 1.0)
            weakest = f"the largest mass that the torque of joint {arm.joint_names[int(masses.argmin())]} can hold"
            return float(f"{np.floor(mass / digits + 1e-9) * digits:.2g}"), weakest if mass < most else ""
    j = int(np.argmin(room / torque))
    raise RobotError(
        f"robot model {model}: joint {arm.joint_names[j]}: its largest torque is {torque[j]:.3g}, holding the bare arm "
        f"takes {need[j]:.3g} or more at {100.0 * (1.0 - CALMER[-1][0]):.0f} % of its positions; correct its effort or "
        "force range, or the masses of the links, or state the torques of all joints with --torque"
    )


def home_pose(
    arm: Arm,
    facts: ModelFacts,
    clearance: Callable[[Array], Array],
    given: Sequence[float] | None = None,
    far: float = CLEAR,
) -> Stated:
    """Return a given start pose, or the first clear one of keyframe, zero, middle of the ranges and random poses.

    `clearance` returns the smallest distance to floor and arm at each pose [m]; a pose is clear from `far` [m] on. If
    none is clear, it is the pose with the largest distance.

    Raises:
        RobotError: If the given pose is not valid for the arm.
    """
    lower, upper = ends(arm)
    if given is not None:
        if len(given) != arm.n:
            joints = ", ".join(arm.joint_names)
            raise RobotError(f"home: {len(given)} positions, but the arm has {arm.n} joints: {joints}")
        for name, q, low, high in zip(arm.joint_names, given, lower, upper, strict=True):
            if not low <= q <= high:
                raise RobotError(f"home: joint {name} at {q:g}: expected {low:.4g} to {high:.4g}, its range")
        return assumed(np.array(given), "the pose that rx90 new-robot was given")
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    random = np.random.default_rng(0).uniform(middle - 0.5 * half, middle + 0.5 * half, (100, arm.n))
    poses = [(np.zeros(arm.n), "zero"), (middle, "the middle of the ranges"), *((q, "a random pose") for q in random)]
    if facts.home and all(name in facts.home for name in arm.joint_names):
        keyframe = np.array([facts.home[name] for name in arm.joint_names])
        poses.insert(0, (keyframe, f"keyframe {facts.home_name!r} of the model file"))
    inside = [(q, what) for q, what in poses if (np.abs(q - middle) <= 0.7 * half).all()]
    distance = clearance(np.array([q for q, _ in inside]))
    chosen = int(np.argmax(distance >= far)) if (distance >= far).any() else int(np.argmax(distance))
    pose, what = inside[chosen]
    said = "the first pose tried that is clear of floor and arm"
    if distance[chosen] < far:
        said = (
            f"the pose with the largest clearance, {1e3 * distance[chosen]:.0f} mm; none of the poses tried is clear "
            f"of floor and arm by {1e3 * far:g} mm"
        )
    return assumed(pose, f"{what}, {said}")


def random_torques(
    arm: Arm, model: Path, flange: str | None, most: Array, load: PayloadBody | None, *, pace: float = PACE
) -> Array:
    """Return torques at random states with speeds up to `pace` times `most` [N m or N], shape (STATES, n)."""
    rng, acceleration = np.random.default_rng(0), DEFAULTS["acceleration"].value
    q = rng.uniform(*ends(arm), (STATES, arm.n))
    dq, ddq = (rng.uniform(-end, end, (STATES, arm.n)) for end in (pace * most, pace * acceleration * most))
    return inverse_dynamics(bare_arm(model, np.zeros(arm.n), flange, load), q, dq, ddq)


def ends(arm: Arm) -> tuple[Array, Array]:
    """Return lower and upper ends of the joints' ranges, each (n,); one turn for an unlimited joint."""
    endless = ~np.isfinite(arm.upper - arm.lower)
    return np.where(endless, -HALF_TURN, arm.lower), np.where(endless, HALF_TURN, arm.upper)


def beside_the_axis(arm: Arm) -> Array:
    """Return the centre of a payload in the last link's frame: an eighth of the reach off the axis, and along it.

    Along the axis it lies on the side away from the preceding joint.
    """
    axis, step = arm.axis[-1], arm.translation[-1]
    reach = float(np.linalg.norm(arm.translation[1:], axis=1).sum()) or 1.0
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    outwards = 1.0 if axis @ (arm.rotation[-1].T @ step) >= 0.0 else -1.0
    return np.round(reach * (0.1 * across + 0.07 * np.cross(axis, across) + 0.06 * outwards * axis), 3)


def bar(mass: float, com: Array) -> Payload:
    """Return a steel bar of a mass [kg], sides 1 : 1 : 3, the long one along z, centre [m] in the last link's frame."""
    side = (mass / (3.0 * DENSITY)) ** (1.0 / 3.0)
    thick, thin = (float(f"{mass * side**2 * k / 12.0:.4g}") for k in (10.0, 2.0))
    x, y, z = (float(c) for c in com)
    return Payload(mass=mass, com=(x, y, z), inertia=(thick, thick, thin, 0.0, 0.0, 0.0))
