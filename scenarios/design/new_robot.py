"""A robot from its model file: `robot.toml` and `scenario.toml`, of what the file states and of ten defaults.

Defaults are a starting point: each is written into the user's file with its source, and should be replaced.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from ident.model.arm import Arm, check_own_motors, stated_transmission, with_transmission
from ident.payload.payload import LIGHTEST, Payload, payload_to_table, read_payload
from ident.support.arrays import Array
from ident.support.errors import PayloadError
from scenarios.design.excitation import HALF_TURN, Design, percents
from scenarios.design.model_facts import ModelFacts, model_facts
from scenarios.experiments.robots import joints_of_both
from scenarios.experiments.scenario import load_scenario, setup_without_motion
from scenarios.experiments.schema import TURNS, body_of
from scenarios.support.texts import schema_line, toml_value
from sim.controller import inverse_dynamics
from sim.errors import PlantError
from sim.plant import bare_arm
from sim.shapes import CLEARANCE

ROBOT, SCENARIO, MOTION = "robot.toml", "scenario.toml", "motion.toml"


class Default(NamedTuple):
    """A number, or a factor on the quantity `of` of `[drives]`, with its source."""

    value: float
    source: str
    second: float = 0.0  # of prismatic joints, of the amplifier offset beside the asymmetry, upper end of resonances
    of: str = ""


DEFAULTS = {
    "max_velocity": Default(2.0, "2 rad/s or 0.4 m/s", second=0.4),
    "max_acceleration": Default(4.0, "4 1/s times the largest speed; the RX-90's has 3 to 6", of="max_velocity"),
    "current_limit": Default(2.0, "2 times what random motions need with a load of 10 % of the moving mass"),
    "load": Default(0.1, "10 % of the moving links' mass; data sheets state 8 to 30 %"),
    "rotor_inertia": Default(
        0.0065, "0.0065 times the largest torque; the RX-90's has 0.005 to 0.0075", of="current_limit"
    ),
    "viscous_friction": Default(
        10.0, "10 1/s times the rotor inertia; an identified TX-40 has 15 to 60", of="rotor_inertia"
    ),
    "coulomb_friction": Default(
        1.0, "1 rad/s or m/s times the viscous friction; an identified TX-40 has 0.9 to 3.2", of="viscous_friction"
    ),
    "coulomb_asymmetry": Default(
        0.03,
        "3 % of the Coulomb friction, amplifier offset 2 %; an identified TX-40 has 5 % together",
        second=0.02,
        of="coulomb_friction",
    ),
    "resonance": Default(20.0, "rotor resonances on the transmissions at 20 to 30 Hz", second=30.0),
    "zeros": Default(0.00175, "0.1 degrees, 0.1 mm for a prismatic joint: a calibrated arm", second=0.0001),
}
STATES, PACE = 200, 1.0 / 3.0
"""Number of random states for torques, and their speed and acceleration relative to the largest ones."""
LOADED = 0.3
"""Largest torque of the payload, as a share of a joint's; arm and payload may take 0.8 together."""
CLEAR = 2.0 * CLEARANCE
"""Smallest distance of a clear home pose to floor and arm [m]."""
SHOWN = 0.028
"""Largest predicted relative standard deviation of a gain that the scenario requires.

Above 0.1 a gain is refused, and what is not predicted here, as friction that depends on the load, makes that of `nls`
on simulated logs up to 3.6 times as large, on weak joints of 30 model files.
"""
TURNED = "logs have positions q_motor = A q and currents of the motors"
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
    """Numbers, shape (n,), with origin (a word per joint, or one for all) and source (a sentence)."""

    value: Array
    source: str
    origin: str | tuple[str, ...] = "assumed"

    def toml(self) -> str:
        """Return the lines of its table, without the header."""
        return (
            f"value = {_digits(self.value, 6)}\norigin = {toml_value(self.origin)}\nsource = {toml_value(self.source)}"
        )

    def assumed(self, j: int) -> bool:
        """Return whether the number of a joint is assumed."""
        return (self.origin if isinstance(self.origin, str) else self.origin[j]) == "assumed"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewRobot:
    """A robot from its model file and defaults; `drives` are tables of a robot file, `rated_load` is in kg."""

    name: str
    path: Path
    arm: Arm
    flange: str | None
    facts: ModelFacts
    rated_load: float | None
    drives: Mapping[str, Stated]
    payload: Payload
    payload_source: str
    home: Stated
    transmission: Array | None = None  # matrix of motors that several joints turn, (n, n)

    @property
    def payload_warning(self) -> str | None:
        """Why the payload may be too heavy, None if nothing suggests it."""
        if self.rated_load is None:
            return "no rated load is specified: look it up in the data sheet and state it with --rated-load"
        over = self.payload.mass > self.rated_load
        return f"{self.payload.mass:g} kg is above the rated load, {self.rated_load:g} kg" if over else None

    def robot_text(self, model: str) -> str:
        """Return the text of its robot file, which names the model file so."""
        lines = [
            schema_line("robot"),
            f"# Joints: {', '.join(f'{k} {name}' for k, name in enumerate(self.arm.joint_names, 1))}",
            "# A first version: replace assumed values by known ones. origin is published, measured or assumed, one",
            "# word or one per joint. Units of a prismatic joint are in brackets.",
            f"name = {toml_value(self.name)}",
            f"model = {toml_value(model)}  # masses, centres and inertias of links are those of this file",
            f"{'# ' * (self.flange is None)}flange = {toml_value(self.flange or 'BODY')}  # last body of the arm, "
            "without a gripper: joints outside the chain to it are locked",
        ]
        if self.transmission is not None:
            lines += [f"transmission = {self.transmission.tolist()!r}  # of the tendons of the file: {TURNED}"]
        if self.rated_load is not None:
            lines += ["", "[rated_load]  # kg; upper limit of what `rx90 payload` designs"]
            lines += [f'value = {self.rated_load!r}\norigin = "assumed"\nsource = "given to rx90 new-robot"']
        lines += ["", "[home]  # rad (m)", self.home.toml()]
        for name, (turns, slides) in UNITS.items():
            unit = turns if self.arm.revolute.all() or turns == slides else f"{turns} ({slides})"
            lines += ["", f"[drives.{name}]  # {unit}", self.drives[name].toml()]
        return "\n".join(lines) + "\n"

    def scenario_text(self, predicted: Sequence[float]) -> str:
        """Return the text of its scenario file. `predicted` are relative standard deviations of the gains."""
        believed = {key: value for key, value in payload_to_table(self.payload).items() if key != "known"}
        true = {key: value for key, value in believed.items() if not key.endswith("_std")}
        tolerance = _digits(np.maximum(0.02, 4.0 * np.minimum(predicted, 1.0)), 2)
        resonance, zeros = DEFAULTS["resonance"], DEFAULTS["zeros"]
        soft = _digits(1.0 / (self.drives["rotor_inertia"].value * (2.0 * np.pi * resonance.second) ** 2), 3)
        more = _digits(np.array(soft) * ((resonance.second / resonance.value) ** 2 - 1.0), 3)
        elastic = (
            f"""[sources."joint elasticity"]  # assumed: {resonance.source}
target = "plant.errors.joint_compliance"
distribution = "uniform"
parameters = {{ loc = {soft!r}, scale = {more!r} }}  # rad/(N m), m/N for a prismatic joint
shared = true

"""
            if self.transmission is None
            else ""
        )
        return f"""{schema_line("scenario")}
extends = "any-arm"          # controller, sensors and error sources that all arms share
description = {toml_value(f"{self.name} as its model file describes it, with drives and friction by rules of thumb")}
robot = "{ROBOT}"         # beside this file

[plant]                      # what is true; drives that are not stated are those of {ROBOT}
payload = {toml_value(true)}
# {self.payload_source}
# kg, m in the frame of the last link, kg m^2 about the centre of mass

[experiment]
motion = "{MOTION}"       # found within the limits of {ROBOT}; rx90 excite finds a better one
# protocol = {toml_value(list(TURNS))}  # in place of bare, loaded: measures how much the gains drift

[belief]                     # what controller and identification assume
controller_gain = {self.drives["gain"].value.tolist()!r}  # those of {ROBOT}
payload = {toml_value(believed)}  # as it is

[tolerance]
gain = {tolerance!r}  # relative; four predicted standard deviations, 2 % at least
identifiable = {toml_value([each <= SHOWN for each in predicted])}  # predicted standard deviations \
[%]: {percents(predicted)}; limit: {100.0 * SHOWN:g}

{elastic}[sources."zeros of joints"]  # assumed: {zeros.source}
target = "plant.errors.zero_error"
distribution = "norm"
parameters = {{ scale = {[zeros.value if turns else zeros.second for turns in self.arm.revolute]!r} }}  # rad, m for a \
prismatic joint
"""

    def write(self, folder: Path, model: str, predicted: Sequence[float]) -> None:
        """Write robot and scenario file; `model` is the path of the model file in the former."""
        (folder / ROBOT).write_text(self.robot_text(model), encoding="utf-8")
        (folder / SCENARIO).write_text(self.scenario_text(predicted), encoding="utf-8")

    def design(self) -> Design:
        """Return the problem of a motion for its scenario, as read from its files, without leaving them."""
        with TemporaryDirectory() as folder:
            self.write(Path(folder), str(self.path.resolve()), [0.0] * self.arm.n)
            return Design.of(setup_without_motion(load_scenario(str(Path(folder) / SCENARIO))))


def new_robot(
    path: Path,
    *,
    flange: str | None = None,
    home: Sequence[float] | None = None,
    torque: Sequence[float] | None = None,
    rated_load: float | None = None,
    payload: Path | float | None = None,
) -> NewRobot:
    """Read a model file, and complete it by defaults.

    `torque` are the largest ones of the joints [N m or N], `home` is the start pose [rad or m], `rated_load` in kg,
    `payload` a file, or the mass of a bar [kg]; None for defaults. Raises `RobotModelError` if the file is no arm, or
    identification and simulation read it differently, a `SimulationError` or `PayloadError` if it cannot be simulated.
    """
    (arm, minimal), facts = joints_of_both(path, (), flange), model_facts(path, flange)
    transmission = stated_transmission(minimal, arm.joint_names)
    if transmission is None:
        check_own_motors(arm, minimal)
    else:
        with_transmission(arm, transmission)  # refuses one that is not possible
    A = np.eye(arm.n) if transmission is None else transmission
    for what, given in (("home", home), ("torque", torque)):
        if given is not None and len(given) != arm.n:
            joints = ", ".join(arm.joint_names)
            raise PlantError(f"{what}: {len(given)} values, but the arm has {arm.n} joints: {joints}")
    compiled = bare_arm(path, np.zeros(arm.n), flange)
    usual = DEFAULTS["load"].value * float(compiled.body_subtreemass[compiled.jnt_bodyid[0]])
    torques = partial(random_torques, arm, path, flange, A)
    drives = drives_by_default(arm, path, facts, lambda speed: torques(speed, bar(arm, usual)), A, torque)
    if isinstance(payload, Path):
        mounted, source = read_payload(payload), f"as specified in {payload.name}"
        if mounted.com is None or mounted.inertia is None:
            raise PayloadError(f"{payload}: a simulation needs com and inertia of the payload; state both")
    elif payload is not None:
        mounted, source = bar(arm, payload), "a steel bar of proportions 1 : 1 : 3 of the mass that was given"
    else:
        speed = drives["max_velocity"].value
        each = np.abs(torques(speed, bar(arm, 1.0)) - torques(speed, None)).max(axis=0)
        mounted, source = first_payload(arm, drives["current_limit"].value / np.maximum(each, 1e-9), usual, rated_load)
    new = NewRobot(
        name=re.sub(r"[^A-Za-z0-9_-]+", "-", arm.name).strip("-") or "robot",
        path=path,
        arm=arm,
        flange=flange,
        facts=facts,
        rated_load=rated_load,
        drives=drives,
        payload=mounted,
        payload_source=source,
        home=Stated(np.zeros(arm.n), "zero"),
        transmission=transmission,
    )
    return replace(new, home=home_pose(arm, facts, new.design(), home))


def drives_by_default(
    arm: Arm,
    model: Path,
    facts: ModelFacts,
    need: Callable[[Array], Array],
    A: Array,
    torque: Sequence[float] | None = None,
) -> dict[str, Stated]:
    """Return the tables of `[drives]`, of motors, which turn by A q; `need` has torques at speeds up to given ones."""

    def stated(values: Mapping[str, float], name: str, default: Array) -> Stated:
        value = _digits([values.get(joint, default[j]) for j, joint in enumerate(arm.joint_names)], 4)
        origin = tuple("published" if joint in values else "assumed" for joint in arm.joint_names)
        parts = [f"stated in {model.name}"] * ("published" in origin) + [DEFAULTS[name].source] * ("assumed" in origin)
        one = origin if len(set(origin)) > 1 else origin[0]
        return Stated(np.array(value), "; where it does not: ".join(parts), one)

    usual = DEFAULTS["max_velocity"]
    speed = stated(facts.velocity, "max_velocity", np.abs(A) @ np.where(arm.revolute, usual.value, usual.second))
    limit = Stated(np.array(torque), "the torques that rx90 new-robot was given")
    if torque is None:
        most = DEFAULTS["current_limit"].value * np.abs(need(speed.value)).max(axis=0)
        limit = stated(facts.torque, "current_limit", most)
    drives = {
        "gain": Stated(np.ones(arm.n), "a log of torques from the manufacturer's constants: 1 unit is 1 N m or 1 N"),
        "current_limit": replace(limit, source=f"largest torque over gain; torque: {limit.source}"),
        "max_velocity": speed,
    }
    for name, default in DEFAULTS.items():
        if default.of:
            drives[name] = Stated(default.value * drives[default.of].value, default.source)
    offsets = DEFAULTS["coulomb_asymmetry"]
    return drives | {"amplifier_offset": Stated(offsets.second * drives[offsets.of].value, offsets.source)}


def first_payload(arm: Arm, carried: Array, usual: float, rated: float | None) -> tuple[Payload, str]:
    """Return a steel bar of the rated or usual mass, or what the weakest joint can carry [kg], and its source.

    `carried` are the masses that take the whole torque of each joint; `PlantError` if a joint carries next to nothing.
    """
    weakest = int(carried.argmin())
    limits = [
        (usual, f"no rated load is specified, so {DEFAULTS['load'].source}")
        if rated is None
        else (rated, f"the rated load of {rated:g} kg"),
        (LOADED * float(carried[weakest]), f"what takes {100.0 * LOADED:g} % of joint {arm.joint_names[weakest]}"),
    ]
    mass, why = min(limits)
    if mass < LIGHTEST:
        raise PlantError(
            f"joint {arm.joint_names[weakest]}: its largest torque carries no payload; correct its effort or force "
            "range, or the masses of the links, or state the torques of all joints with --torque"
        )
    mass = int(1e3 * mass + 1e-6) / 1e3
    return bar(arm, mass), f"assumed: a steel bar of proportions 1 : 1 : 3 beside the axis of the last joint; {why}"


def home_pose(arm: Arm, facts: ModelFacts, design: Design, given: Sequence[float] | None = None) -> Stated:
    """Return a given start pose, or the first of several that is clear of floor and arm, or the farthest from them."""
    limits = design.limits
    if given is not None:
        for name, q, low, high in zip(arm.joint_names, given, limits.lower, limits.upper, strict=True):
            if not low <= q <= high:
                raise PlantError(f"home: joint {name} at {q:g}: expected {low:.4g} to {high:.4g}, its range")
        return Stated(np.array(given), "the pose that rx90 new-robot was given")
    random = limits.center + 0.5 * limits.half * np.random.default_rng(0).uniform(-1.0, 1.0, (100, arm.n))
    poses = [(np.zeros(arm.n), "zero"), (limits.center, "the middle of the ranges")]
    poses += [(q, "a random pose") for q in random]
    if all(name in facts.home for name in arm.joint_names):
        poses.insert(0, (np.array([facts.home[name] for name in arm.joint_names]), "a keyframe of the model file"))
    inside = [(q, what) for q, what in poses if (np.abs(q - limits.center) <= 0.7 * limits.half).all()]
    distance = np.minimum(design.clearance(np.array([q for q, _ in inside])), CLEAR)
    pose, what = inside[int(np.argmax(distance))]  # the first clear one, or the farthest
    return Stated(pose, f"{what}, {1e3 * distance.max():.0f} mm or more from floor and arm")


def random_torques(arm: Arm, model: Path, flange: str | None, A: Array, speed: Array, load: Payload | None) -> Array:
    """Return torques of the motors, which turn by A q, at random states [N m or N], shape (STATES, n).

    A joint's speed is up to `PACE` times what each motor, at its own of `speed`, allows it if the others rest.
    """
    with np.errstate(divide="ignore"):
        speed = (speed[:, None] / np.abs(A)).min(axis=0)
    rng, acceleration = np.random.default_rng(0), DEFAULTS["max_acceleration"].value
    endless = ~np.isfinite(arm.upper - arm.lower)
    ends = np.where(endless, -HALF_TURN, arm.lower), np.where(endless, HALF_TURN, arm.upper)
    q = rng.uniform(*ends, (STATES, arm.n))
    dq, ddq = (rng.uniform(-end, end, (STATES, arm.n)) for end in (PACE * speed, PACE * acceleration * speed))
    body = None if load is None else body_of(load)
    return inverse_dynamics(bare_arm(model, np.zeros(arm.n), flange, body), q, dq, ddq) @ np.linalg.inv(A)


def bar(arm: Arm, mass: float) -> Payload:
    """Return a steel bar of a mass [kg], sides 1 : 1 : 3, an eighth of the reach off the last axis."""
    axis, step = arm.axis[-1], arm.translation[-1]
    reach = float(np.linalg.norm(arm.translation[1:], axis=1).sum()) or 1.0
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    outwards = 1.0 if axis @ (arm.rotation[-1].T @ step) >= 0.0 else -1.0
    x, y, z = np.round(reach * (0.1 * across + 0.07 * np.cross(axis, across) + 0.06 * outwards * axis), 3).tolist()
    side = (mass / (3.0 * 7850.0)) ** (1.0 / 3.0)  # of steel [kg/m^3]
    thick, thin = _digits([mass * side**2 * k / 12.0 for k in (10.0, 2.0)], 4)
    return Payload(mass=mass, com=(x, y, z), inertia=(thick, thick, thin, 0.0, 0.0, 0.0))


def _digits(values: Iterable[float], digits: int) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in values]
