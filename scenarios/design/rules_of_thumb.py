"""Rules of thumb for what no model file says, drives, limits, a pose and a payload, each with its reason.

They make a start, not a robot: every number is written into a file of the user's, with its origin, to be replaced.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.support.arrays import Array
from scenarios.design.limits import HALF_TURN
from scenarios.design.model_facts import ModelFacts
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.errors import RobotError
from sim.plant import PayloadBody

SPEED, SLIDE = 2.0, 0.4
"""Largest speed of a joint whose file states none [rad/s], [m/s]."""
ACCELERATION = 4.0
"""Largest acceleration over largest speed [1/s]; the RX-90's robot file has 3 to 6."""
ROTOR = 0.0065
"""Rotor inertia over largest torque [kg m^2/(N m)], or mass over force; the RX-90's file has 0.005 to 0.0075."""
VISCOUS = 10.0
"""Viscous friction over rotor inertia [1/s]; an identified TX-40 has 15 to 60, the RX-90's robot file 10."""
COULOMB = 1.0
"""Coulomb over viscous friction [rad/s or m/s]; an identified TX-40 has 0.9 to 3.2, the RX-90's file 0.8 to 1.5."""
ASYMMETRY, OFFSET = 0.03, 0.02
"""Shares of the Coulomb friction; an identified TX-40 has a total offset of 5 %."""
NEEDED = 2.0
"""Largest torque over the one that random states at a third of speed and acceleration need, where none is stated."""
LOADED = 0.3
"""Share of any joint's largest torque that the payload may ask for."""
RATED = 0.1
"""Mass of a usual load over that of all moving links; rated loads are 0.08 (TX-40) to 0.3 (UR10e) of them."""
TORQUE_SHARE = 0.75
"""Share of any joint's largest torque that arm and payload may ask for together; a search for a motion allows 0.8."""
STATES = 200
"""Random states over which torques are taken."""
USUAL = 0.9
"""Share of these states that a payload leaves room for; a search for a motion keeps clear of the others."""
HEAVIEST = 10.0
"""Largest payload [kg]."""
DENSITY = 7850.0
"""Of steel [kg/m^3]."""
LOAD_SOURCE = (
    f"assumed: a steel bar of 1 x 1 x 3 beside the last joint's axis; it takes at most {100.0 * LOADED:g} % of any "
    f"joint's largest torque and weighs at most {HEAVIEST:g} kg"
)
"""What a payload by rule is."""


@dataclass(frozen=True, slots=True, eq=False)
class Stated:
    """Numbers, one a joint, where each is from, and who says so.

    Attributes:
        value: Shape (n,).
        origin: One word a joint.
        source: A sentence.
    """

    value: Array
    origin: tuple[str, ...]
    source: str


def assumed(value: Array, source: str) -> Stated:
    """Numbers that nobody published."""
    return Stated(value, ("assumed",) * len(value), source)


def drives_by_rule(arm: Arm, model: Path, flange: str | None, facts: ModelFacts) -> dict[str, Stated]:
    """The tables of a robot file's `[drives]`, by name.

    Args:
        arm: The arm.
        model: Its model file.
        flange: Last body of the arm, None where all joints are its own.
        facts: What the file says.
    """
    usual = np.where(arm.revolute, SPEED, SLIDE)
    speed = _or_rule(arm, facts.velocity, usual, f"{SPEED:g} rad/s or {SLIDE:g} m/s", model)
    acceleration = ACCELERATION * speed.value
    compiled = bare_arm(model, np.zeros(arm.n), flange)
    moving_mass = float(compiled.body_subtreemass[compiled.jnt_bodyid[0]])
    load = _bar(RATED * moving_mass, _beside_the_axis(arm))
    need = np.abs(_random_torques(arm, model, flange, speed.value, load)).max(axis=0)
    words = f"{NEEDED:g} times what random motions need with a load of {100.0 * RATED:g} % of the moving mass"
    torque = _or_rule(arm, facts.torque, NEEDED * need, words, model)
    rotor = ROTOR * torque.value
    viscous = VISCOUS * rotor
    coulomb = COULOMB * viscous
    rules = {
        "gain": (np.ones(arm.n), "a log of torques computed with the maker's own constants: 1 unit is 1 N m or 1 N"),
        "rotor_inertia": (rotor, f"{ROTOR:g} times the largest torque; the RX-90's has 0.005 to 0.0075"),
        "viscous_friction": (viscous, f"{VISCOUS:g} 1/s times the rotor inertia; an identified TX-40 has 15 to 60"),
        "coulomb_friction": (
            coulomb,
            f"{COULOMB:g} rad/s or m/s times the viscous friction; an identified TX-40 has 0.9 to 3.2",
        ),
        "coulomb_asymmetry": (ASYMMETRY * coulomb, "3 % of the Coulomb friction, as on an identified TX-40"),
        "amplifier_offset": (OFFSET * coulomb, "2 % of the Coulomb friction, as on an identified TX-40"),
    }
    limit = Stated(torque.value, torque.origin, f"largest torque over gain; torque: {torque.source}")
    most = f"{ACCELERATION:g} 1/s times the largest speed; the RX-90's robot file has 3 to 6"
    return {
        **{name: assumed(value, source) for name, (value, source) in rules.items()},
        "current_limit": limit,
        "max_velocity": speed,
        "max_acceleration": assumed(acceleration, most),
    }


def load_by_rule(arm: Arm, model: Path, flange: str | None, drives: Mapping[str, Stated]) -> PayloadBody:
    """A payload that every joint feels and none is overloaded by, `LOAD_SOURCE`.

    Raises:
        RobotError: If the bare arm alone needs more than a joint's largest torque.
    """
    torque, com = drives["current_limit"].value, _beside_the_axis(arm)
    bare, loaded = (
        _random_torques(arm, model, flange, drives["max_velocity"].value, x) for x in (None, _bar(1.0, com))
    )
    need, each = np.quantile(np.abs(bare), USUAL, axis=0), np.abs(loaded - bare).max(axis=0)
    room = np.minimum(LOADED * torque, TORQUE_SHARE * torque - need)
    for j in np.flatnonzero(room <= 0.0):
        raise RobotError(
            f"robot model {model}: joint {arm.joint_names[j]}: its largest torque is {torque[j]:.3g}, moving the bare "
            f"arm takes {need[j]:.3g}; correct its effort or force range, or the masses of the links"
        )
    most = min(HEAVIEST, float(np.min(room / np.maximum(each, 1e-9))))
    digits = 10.0 ** (np.floor(np.log10(most)) - 1.0)
    return _bar(float(f"{np.floor(most / digits) * digits:.2g}"), com)


def home_by_rule(arm: Arm, facts: ModelFacts, clearance: Callable[[Array], Array], far: float) -> Stated:
    """A pose to start from: a keyframe's, zero, the middle of the ranges or a random one, the first that is clear.

    Args:
        arm: The arm.
        facts: What the file says.
        clearance: Smallest distance at each pose [m].
        far: What counts as clear [m].
    """
    lower, upper = _ends(arm)
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
    if distance[chosen] >= far:
        return assumed(pose, f"{what}, the first pose tried that is clear of floor and arm")
    return assumed(
        pose,
        f"{what}; none of the poses tried is clear of floor and arm by {1e3 * far:g} mm; this one has the "
        f"largest clearance, {1e3 * distance[chosen]:.0f} mm",
    )


def given_home(arm: Arm, pose: Sequence[float]) -> Stated:
    """A pose that somebody names.

    Raises:
        RobotError: If it is none of the arm's.
    """
    if len(pose) != arm.n:
        raise RobotError(f"home: {len(pose)} positions, but the arm has {arm.n} joints: {', '.join(arm.joint_names)}")
    lower, upper = _ends(arm)
    for name, q, low, high in zip(arm.joint_names, pose, lower, upper, strict=True):
        if not low <= q <= high:
            raise RobotError(f"home: joint {name} at {q:g}: expected {low:.4g} to {high:.4g}, its range")
    return assumed(np.array(pose), "the pose that rx90 new-robot was given")


def _random_torques(arm: Arm, model: Path, flange: str | None, most: Array, load: PayloadBody | None) -> Array:
    """Torques in random states up to a third of speed `most` and acceleration [N m or N], shape (STATES, n)."""
    lower, upper = _ends(arm)
    rng = np.random.default_rng(0)
    q = rng.uniform(lower, upper, (STATES, arm.n))
    dq, ddq = (rng.uniform(-end, end, (STATES, arm.n)) for end in (most / 3.0, ACCELERATION * most / 3.0))
    return inverse_dynamics(bare_arm(model, np.zeros(arm.n), flange, load), q, dq, ddq)


def _ends(arm: Arm) -> tuple[Array, Array]:
    """Lower and upper ends of the joints' ranges, each (n,); a joint without any has a turn."""
    endless = ~np.isfinite(arm.upper - arm.lower)
    return np.where(endless, -HALF_TURN, arm.lower), np.where(endless, HALF_TURN, arm.upper)


def _or_rule(arm: Arm, stated: Mapping[str, float], rule: Array, words: str, model: Path) -> Stated:
    """What the file states; by the rule where it states nothing."""
    value = np.array([stated.get(name, rule[j]) for j, name in enumerate(arm.joint_names)])
    value = np.array([float(f"{x:.4g}") for x in value])
    origin = tuple("published" if name in stated else "assumed" for name in arm.joint_names)
    parts = [f"{model.name} states it" if "published" in origin else "", words if "assumed" in origin else ""]
    return Stated(value, origin, "; where it does not: ".join(part for part in parts if part))


def _beside_the_axis(arm: Arm) -> Array:
    """Centre of a payload in the frame of the last link: an eighth of the reach off the axis, and outwards along it."""
    axis, step = arm.axis[-1], arm.translation[-1]
    reach = float(np.linalg.norm(arm.translation[1:], axis=1).sum()) or 1.0
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    outwards = 1.0 if axis @ (arm.rotation[-1].T @ step) >= 0.0 else -1.0
    com = reach * (0.1 * across + 0.07 * other + 0.06 * outwards * axis)
    return np.round(com, 3)


def _bar(mass: float, com: Array) -> PayloadBody:
    """A steel bar with sides 1, 1, 3, the long one along z."""
    side = (mass / (3.0 * DENSITY)) ** (1.0 / 3.0)
    thick, thin = (float(f"{mass * side**2 * k / 12.0:.4g}") for k in (10.0, 2.0))
    x, y, z = (float(c) for c in com)
    return PayloadBody(mass=mass, com=(x, y, z), inertia=(thick, thick, thin, 0.0, 0.0, 0.0))
