"""A robot from its model file: drives, home pose and first payload, each stated, or by one of ten defaults.

Defaults are a starting point: each is written into the user's file with its source, and should be replaced. Largest
torques, if not stated, are what random motions need; the first payload is a steel bar within the rated load and the
torques of the joints, so a weak arm gets a lighter one.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from ident.model.arm import Arm
from ident.payload.payload import Payload, read_payload
from ident.support.arrays import Array
from ident.support.errors import PayloadError
from scenarios.design.excitation import HALF_TURN
from scenarios.design.model_facts import ModelFacts, arm_end, model_facts
from scenarios.experiments.robots import check_same_payload, read_arm
from scenarios.experiments.scenario import body_of
from scenarios.support.texts import schema_line, toml_value
from sim.controller import inverse_dynamics
from sim.errors import PlantError
from sim.plant import Plant, bare_arm
from sim.robot import Robot, read_robot
from sim.shapes import CLEARANCE, Clearance


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
UNITS = {
    "gain": ("N m / drive unit", "N / drive unit"),
    "rotor_inertia": ("kg m^2", "kg"),
    "viscous_friction": ("N m s/rad", "N s/m"),
    "coulomb_friction": ("N m", "N"),
    "coulomb_asymmetry": ("N m", "N"),
    "amplifier_offset": ("drive units", "drive units"),
    "current_limit": ("drive units", "drive units"),
    "max_velocity": ("rad/s", "m/s"),
    "max_acceleration": ("rad/s^2", "m/s^2"),
}
"""Units of the tables of `[drives]`, for revolute and prismatic joints."""


@dataclass(frozen=True, slots=True, eq=False)
class Stated:
    """Numbers, shape (n,), with origin (a word per joint) and source (a sentence)."""

    value: Array
    origin: tuple[str, ...]
    source: str

    def toml(self) -> str:
        """Return the lines of its table, without the header."""
        origin = self.origin[0] if len(set(self.origin)) == 1 else self.origin
        value = [float(f"{x:.6g}") for x in self.value]
        return f"value = {value}\norigin = {toml_value(origin)}\nsource = {toml_value(self.source)}"


def assumed(value: Array, source: str) -> Stated:
    """Return assumed numbers."""
    return Stated(value, ("assumed",) * len(value), source)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewRobot:
    """A robot from its model file and defaults.

    Attributes:
        path: The model file.
        flange: Last body of the arm, None if all joints belong to it.
        held: Joints recognised as those of a gripper.
        rated_load: [kg], None if not stated.
        drives: Values by table of a robot file's `[drives]`.
        payload: The first payload, complete.
        payload_source: Its source, a sentence.
        payload_warning: Why it may be too heavy, empty if nothing suggests it.
        home: Start pose of the search for a motion.
    """

    name: str
    path: Path
    arm: Arm
    flange: str | None
    held: tuple[str, ...]
    facts: ModelFacts
    rated_load: float | None
    drives: Mapping[str, Stated]
    payload: Payload
    payload_source: str
    payload_warning: str
    home: Stated

    def text(self, model: str) -> str:
        """Return the text of its robot file, which names the model file so."""
        lines = [
            schema_line("robot"),
            f"# Joints: {', '.join(f'{k} {name}' for k, name in enumerate(self.arm.joint_names, 1))}",
            "# A first version: replace assumed values by known ones. origin is published, measured or assumed, one",
            "# word or one per joint. Units of a prismatic joint are in brackets.",
            f"name = {toml_value(self.name)}",
            f"model = {toml_value(model)}  # masses, centres and inertias of links are those of this file",
        ]
        if self.flange is not None:
            said = "last body of the arm; joints outside the chain to it are locked"
            lines.append(f"flange = {toml_value(self.flange)}  # {said}")
        if self.rated_load is not None:
            lines += ["", "[rated_load]  # kg; upper limit of what `rx90 payload` designs"]
            lines += [f'value = {self.rated_load!r}\norigin = "assumed"\nsource = "given to rx90 new-robot"']
        lines += ["", "[home]  # rad (m)", self.home.toml()]
        for name, (turns, slides) in UNITS.items():
            unit = turns if self.arm.revolute.all() or turns == slides else f"{turns} ({slides})"
            lines += ["", f"[drives.{name}]  # {unit}", self.drives[name].toml()]
        return "\n".join(lines) + "\n"

    def robot(self) -> Robot:
        """Return the robot as read from its file, without leaving the file."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / "robot.toml"
            path.write_text(self.text(str(self.path.resolve())), encoding="utf-8")
            return read_robot(path)


def new_robot(
    path: Path,
    *,
    flange: str | None = None,
    name: str | None = None,
    home: Sequence[float] | None = None,
    torque: Sequence[float] | None = None,
    rated_load: float | None = None,
    payload: Path | float | None = None,
) -> NewRobot:
    """Read a model file, and complete it by defaults.

    `torque` are the largest ones of the joints [N m or N], `home` is the start pose [rad or m], `rated_load` in kg,
    `payload` a file, or the mass of a bar [kg]; None for defaults. Joints outside the chain to `flange` are locked.

    Raises:
        RobotModelError: If the file is not an arm; if identification and simulation read it differently.
        PlantError: If torques or home pose do not fit the arm, or joints are too weak.
        PayloadError: If the payload file is not valid.
        SimulationError: One of its kinds, if links lack an inertia.
    """
    last, held = (flange, ()) if flange is not None else arm_end(path)
    arm, facts = read_arm(path, (), flange=last), model_facts(path, last)
    drives = drives_by_default(arm, path, last, facts, torque)
    mounted, source, warning = first_payload(arm, path, last, drives, rated=rated_load, payload=payload)
    new = NewRobot(
        name=name or re.sub(r"[^A-Za-z0-9_-]+", "-", arm.name).strip("-") or "robot",
        path=path,
        arm=arm,
        flange=last,
        held=held,
        facts=facts,
        rated_load=rated_load,
        drives=drives,
        payload=mounted,
        payload_source=source,
        payload_warning=warning,
        home=assumed(np.zeros(arm.n), "zero"),
    )
    robot = new.robot()
    check_same_payload(arm, robot)
    clearance = Clearance(Plant(robot=robot, drives=robot.drives, payload=body_of(mounted)), margin=CLEAR)
    return replace(new, home=home_pose(arm, facts, clearance, home))


def drives_by_default(
    arm: Arm, model: Path, flange: str | None, facts: ModelFacts, torque: Sequence[float] | None = None
) -> dict[str, Stated]:
    """Return the tables of a robot file's `[drives]`, by name; `torque` are stated largest ones [N m or N].

    Raises:
        PlantError: If the number of torques is wrong.
    """

    def stated(values: Mapping[str, float], name: str, default: Array) -> Stated:
        """Return the values of the file, completed by a default."""
        value = [float(f"{values.get(joint, default[j]):.4g}") for j, joint in enumerate(arm.joint_names)]
        origin = tuple("published" if joint in values else "assumed" for joint in arm.joint_names)
        parts = [f"stated in {model.name}"] * ("published" in origin) + [DEFAULTS[name].source] * ("assumed" in origin)
        return Stated(np.array(value), origin, "; where it does not: ".join(parts))

    usual = DEFAULTS["speed"]
    speed = stated(facts.velocity, "speed", np.where(arm.revolute, usual.value, usual.second))
    if torque is None:
        load = bar(arm, DEFAULTS["load"].value * _masses(model, flange, arm)[0])
        need = np.abs(random_torques(arm, model, flange, speed.value, load)).max(axis=0)
        limit = stated(facts.torque, "torque", DEFAULTS["torque"].value * need)
    elif len(torque) != arm.n:
        raise PlantError(f"torque: {len(torque)} values, but the arm has {arm.n} joints: {', '.join(arm.joint_names)}")
    else:
        limit = assumed(np.array(torque), "the torques that rx90 new-robot was given")

    def by(name: str, of: Array) -> Stated:
        return assumed(DEFAULTS[name].value * of, DEFAULTS[name].source)

    rotor = by("rotor inertia", limit.value)
    viscous = by("viscous friction", rotor.value)
    coulomb = by("coulomb friction", viscous.value)
    return {
        "gain": assumed(np.ones(arm.n), "a log of torques from the manufacturer's constants: 1 unit is 1 N m or 1 N"),
        "rotor_inertia": rotor,
        "viscous_friction": viscous,
        "coulomb_friction": coulomb,
        "coulomb_asymmetry": by("offsets", coulomb.value),
        "amplifier_offset": assumed(DEFAULTS["offsets"].second * coulomb.value, DEFAULTS["offsets"].source),
        "current_limit": replace(limit, source=f"largest torque over gain; torque: {limit.source}"),
        "max_velocity": speed,
        "max_acceleration": by("acceleration", speed.value),
    }


def first_payload(
    arm: Arm,
    model: Path,
    flange: str | None,
    drives: Mapping[str, Stated],
    *,
    rated: float | None = None,
    payload: Path | float | None = None,
) -> tuple[Payload, str, str]:
    """Return the payload of a first experiment: a given one, or a bar within rated load and joint torques.

    Returns:
        The payload, its source, and why it may be too heavy, empty if nothing suggests it.

    Raises:
        PlantError: If the bare arm alone needs more than a joint's largest torque.
        PayloadError: If the file is not a complete payload.
    """
    moving, own = _masses(model, flange, arm)
    if isinstance(payload, Path):
        stated, source = read_payload(payload), f"as specified in {payload.name}"
        if stated.com is None or stated.inertia is None:
            raise PayloadError(f"{payload}: a simulation needs com and inertia of the payload; state both")
    elif payload is not None:
        stated, source = bar(arm, payload), "a steel bar of proportions 1 : 1 : 3 of the mass that was given"
    else:
        usual = DEFAULTS["load"].value * moving
        most, why = max(own, usual), f"no rated load is specified, so at most the last link's own mass, {own:.2g} kg"
        if own < usual:
            why = f"no rated load is specified, so at most {usual:.2g} kg: {DEFAULTS['load'].source}"
        if rated is not None:
            most, why = rated, f"within the rated load of {rated:g} kg"
        mass, weakest = _can_carry(arm, model, flange, drives, min(most, HEAVIEST), LEAST * moving)
        stated = bar(arm, mass)
        source = f"assumed: a steel bar of proportions 1 : 1 : 3 beside the axis of the last joint; {weakest or why}"
    warning = ""
    if rated is not None and stated.mass > rated:
        warning = f"{stated.mass:g} kg is above the rated load, {rated:g} kg"
    elif rated is None and stated.mass > 1.005 * own:
        warning = (
            f"{stated.mass:g} kg is more than the last link's own {own:.2g} kg, and no rated load is specified: look "
            "it up in the data sheet and state it with --rated-load"
        )
    return stated, source, warning


def _can_carry(
    arm: Arm, model: Path, flange: str | None, drives: Mapping[str, Stated], most: float, least: float
) -> tuple[float, str]:
    """Return the largest mass up to `most` within the joint torques [kg], and what limits it or an empty text."""
    torque, speed = drives["current_limit"].value, drives["max_velocity"].value
    need = room = np.zeros(arm.n)
    for share, pace in CALMER:
        bare, loaded = (random_torques(arm, model, flange, speed, load, pace=pace) for load in (None, bar(arm, 1.0)))
        need = np.quantile(np.abs(bare), share, axis=0)
        room = np.minimum(LOADED * torque, TORQUE_SHARE * torque - need)
        masses = room / np.maximum(np.abs(loaded - bare).max(axis=0), 1e-9)
        mass = min(most, float(masses.min()))
        if mass >= min(most, least):
            digits = 10.0 ** (np.floor(np.log10(mass)) - 1.0)
            weakest = f"the largest mass that the torque of joint {arm.joint_names[int(masses.argmin())]} can hold"
            return float(f"{np.floor(mass / digits + 1e-9) * digits:.2g}"), weakest if mass < most else ""
    j = int(np.argmin(room / torque))
    raise PlantError(
        f"robot model {model}: joint {arm.joint_names[j]}: its largest torque is {torque[j]:.3g}, holding the bare arm "
        f"takes {need[j]:.3g} or more at {100.0 * (1.0 - CALMER[-1][0]):.0f} % of its positions; correct its effort or "
        "force range, or the masses of the links, or state the torques of all joints with --torque"
    )


def home_pose(
    arm: Arm, facts: ModelFacts, clearance: Callable[[Array], Array], given: Sequence[float] | None = None
) -> Stated:
    """Return a given start pose, or the first clear one of keyframe, zero, middle of the ranges and random poses.

    `clearance` returns the smallest distance to floor and arm at each pose [m]. If no pose is clear, it is the one with
    the largest distance.

    Raises:
        PlantError: If the given pose is not valid for the arm.
    """
    lower, upper = ends(arm)
    if given is not None:
        if len(given) != arm.n:
            joints = ", ".join(arm.joint_names)
            raise PlantError(f"home: {len(given)} positions, but the arm has {arm.n} joints: {joints}")
        for name, q, low, high in zip(arm.joint_names, given, lower, upper, strict=True):
            if not low <= q <= high:
                raise PlantError(f"home: joint {name} at {q:g}: expected {low:.4g} to {high:.4g}, its range")
        return assumed(np.array(given), "the pose that rx90 new-robot was given")
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    random = np.random.default_rng(0).uniform(middle - 0.5 * half, middle + 0.5 * half, (100, arm.n))
    poses = [(np.zeros(arm.n), "zero"), (middle, "the middle of the ranges"), *((q, "a random pose") for q in random)]
    if facts.home and all(name in facts.home for name in arm.joint_names):
        keyframe = np.array([facts.home[name] for name in arm.joint_names])
        poses.insert(0, (keyframe, f"keyframe {facts.home_name!r} of the model file"))
    inside = [(q, what) for q, what in poses if (np.abs(q - middle) <= 0.7 * half).all()]
    distance = np.minimum(clearance(np.array([q for q, _ in inside])), CLEAR)
    chosen = int(np.argmax(distance))  # the first clear one, or the farthest
    pose, what = inside[chosen]
    said = "the first pose tried that is clear of floor and arm"
    if distance[chosen] < CLEAR:
        said = (
            f"the pose with the largest clearance, {1e3 * distance[chosen]:.0f} mm; none of the poses tried is clear "
            f"of floor and arm by {1e3 * CLEAR:g} mm"
        )
    return assumed(pose, f"{what}, {said}")


def random_torques(
    arm: Arm, model: Path, flange: str | None, speed: Array, load: Payload | None, *, pace: float = PACE
) -> Array:
    """Return torques at random states, of speeds up to `pace` times the largest [N m or N], shape (STATES, n)."""
    rng, acceleration = np.random.default_rng(0), DEFAULTS["acceleration"].value
    q = rng.uniform(*ends(arm), (STATES, arm.n))
    dq, ddq = (rng.uniform(-end, end, (STATES, arm.n)) for end in (pace * speed, pace * acceleration * speed))
    body = None if load is None else body_of(load)
    return inverse_dynamics(bare_arm(model, np.zeros(arm.n), flange, body), q, dq, ddq)


def _masses(model: Path, flange: str | None, arm: Arm) -> tuple[float, float]:
    """Return the mass of all moving links and that of the last one [kg]."""
    compiled = bare_arm(model, np.zeros(arm.n), flange)
    moving, own = (float(compiled.body_subtreemass[compiled.jnt_bodyid[j]]) for j in (0, -1))
    return moving, own


def ends(arm: Arm) -> tuple[Array, Array]:
    """Return lower and upper ends of the joints' ranges, each (n,); half a turn either way for an unlimited joint."""
    endless = ~np.isfinite(arm.upper - arm.lower)
    return np.where(endless, -HALF_TURN, arm.lower), np.where(endless, HALF_TURN, arm.upper)


def bar(arm: Arm, mass: float) -> Payload:
    """Return a steel bar of a mass [kg], sides 1 : 1 : 3, the long one along z of the last link.

    Its centre is an eighth of the reach off the last axis, and along it on the side away from the preceding joint.
    """
    axis, step = arm.axis[-1], arm.translation[-1]
    reach = float(np.linalg.norm(arm.translation[1:], axis=1).sum()) or 1.0
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    outwards = 1.0 if axis @ (arm.rotation[-1].T @ step) >= 0.0 else -1.0
    x, y, z = np.round(reach * (0.1 * across + 0.07 * np.cross(axis, across) + 0.06 * outwards * axis), 3).tolist()
    side = (mass / (3.0 * DENSITY)) ** (1.0 / 3.0)
    thick, thin = (float(f"{mass * side**2 * k / 12.0:.4g}") for k in (10.0, 2.0))
    return Payload(mass=mass, com=(x, y, z), inertia=(thick, thick, thin, 0.0, 0.0, 0.0))
