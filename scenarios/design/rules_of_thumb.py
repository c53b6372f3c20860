"""Rules of thumb for values that no model file states: drives, limits, a pose and a payload, each with its reason.

The values are a starting point: each is written into the user's file with its origin, and should be replaced.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.payload.payload import Payload
from ident.support.arrays import Array
from scenarios.design.limits import HALF_TURN
from scenarios.design.model_facts import ModelFacts
from scenarios.experiments.build import body_of
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.errors import RobotError
from sim.plant import PayloadBody

SPEED, SLIDE = 2.0, 0.4
"""Default of a joint's largest speed [rad/s], [m/s]."""
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
"""Default of the largest torque, relative to that of random states at a third of speed and acceleration."""
RATED = 0.1
"""Default load, relative to the mass of the moving links; rated loads are 0.08 (TX-40) to 0.3 (UR10e)."""
STATES = 200
"""Number of random states for torques."""
PACE = 1.0 / 3.0
"""Speed and acceleration of these states, relative to the largest ones."""
DENSITY = 7850.0
"""Density of steel [kg/m^3]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stated:
    """Numbers, one per joint, with origin and source.

    Attributes:
        value: Numbers, shape (n,).
        origin: Origin, one word per joint.
        source: Source, a sentence.
    """

    value: Array
    origin: tuple[str, ...]
    source: str


def assumed(value: Array, source: str) -> Stated:
    """Return assumed numbers."""
    return Stated(value, ("assumed",) * len(value), source)


def drives_by_rule(
    arm: Arm, model: Path, flange: str | None, facts: ModelFacts, given: Sequence[float] | None = None
) -> dict[str, Stated]:
    """Return the tables of a robot file's `[drives]`, by name.

    Args:
        arm: The arm.
        model: Its model file.
        flange: Last body of the arm, None if all joints belong to the arm.
        facts: Data of the model file.
        given: Stated largest torques [N m or N], shape (n,); None for those of the file, or by rule.

    Raises:
        RobotError: If the number of torques is wrong.
    """
    usual = np.where(arm.revolute, SPEED, SLIDE)
    speed = _or_rule(arm, facts.velocity, usual, f"{SPEED:g} rad/s or {SLIDE:g} m/s", model)
    acceleration = ACCELERATION * speed.value
    compiled = bare_arm(model, np.zeros(arm.n), flange)
    load = body_of(bar(RATED * float(compiled.body_subtreemass[compiled.jnt_bodyid[0]]), beside_the_axis(arm)))
    need = np.abs(random_torques(arm, model, flange, speed.value, load)).max(axis=0)
    words = f"{NEEDED:g} times what random motions need with a load of {100.0 * RATED:g} % of the moving mass"
    torque = _or_rule(arm, facts.torque, NEEDED * need, words, model) if given is None else _given_torque(arm, given)
    rotor = ROTOR * torque.value
    viscous = VISCOUS * rotor
    coulomb = COULOMB * viscous
    rules = {
        "gain": (np.ones(arm.n), "a log of torques computed with the manufacturer's constants: 1 unit is 1 N m or 1 N"),
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


def home_by_rule(arm: Arm, facts: ModelFacts, clearance: Callable[[Array], Array], far: float) -> Stated:
    """Return a start pose: the first clear one of keyframe, zero, middle of the ranges and random poses.

    `clearance` returns the smallest distance at each pose [m]; a pose is clear if it is at least `far` [m].
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
    """Return a stated pose.

    Raises:
        RobotError: If it is not valid for the arm.
    """
    if len(pose) != arm.n:
        raise RobotError(f"home: {len(pose)} positions, but the arm has {arm.n} joints: {', '.join(arm.joint_names)}")
    lower, upper = _ends(arm)
    for name, q, low, high in zip(arm.joint_names, pose, lower, upper, strict=True):
        if not low <= q <= high:
            raise RobotError(f"home: joint {name} at {q:g}: expected {low:.4g} to {high:.4g}, its range")
    return assumed(np.array(pose), "the pose that rx90 new-robot was given")


def _given_torque(arm: Arm, given: Sequence[float]) -> Stated:
    if len(given) != arm.n:
        raise RobotError(f"torque: {len(given)} values, but the arm has {arm.n} joints: {', '.join(arm.joint_names)}")
    return assumed(np.array(given), "the torques that rx90 new-robot was given")


def random_torques(
    arm: Arm, model: Path, flange: str | None, most: Array, load: PayloadBody | None, *, pace: float = PACE
) -> Array:
    """Return torques at random states with speeds up to `pace` times `most` [N m or N], shape (STATES, n)."""
    lower, upper = _ends(arm)
    rng = np.random.default_rng(0)
    q = rng.uniform(lower, upper, (STATES, arm.n))
    dq, ddq = (rng.uniform(-end, end, (STATES, arm.n)) for end in (pace * most, pace * ACCELERATION * most))
    return inverse_dynamics(bare_arm(model, np.zeros(arm.n), flange, load), q, dq, ddq)


def _ends(arm: Arm) -> tuple[Array, Array]:
    """Return lower and upper ends of the joints' ranges, each (n,); one turn for an unlimited joint."""
    endless = ~np.isfinite(arm.upper - arm.lower)
    return np.where(endless, -HALF_TURN, arm.lower), np.where(endless, HALF_TURN, arm.upper)


def _or_rule(arm: Arm, stated: Mapping[str, float], rule: Array, words: str, model: Path) -> Stated:
    """Return the values of the file, completed by the rule."""
    value = np.array([stated.get(name, rule[j]) for j, name in enumerate(arm.joint_names)])
    value = np.array([float(f"{x:.4g}") for x in value])
    origin = tuple("published" if name in stated else "assumed" for name in arm.joint_names)
    parts = [f"stated in {model.name}" if "published" in origin else "", words if "assumed" in origin else ""]
    return Stated(value, origin, "; where it does not: ".join(part for part in parts if part))


def beside_the_axis(arm: Arm) -> Array:
    """Return the centre of a payload in the last link's frame: an eighth of the reach off the axis, and along it."""
    axis, step = arm.axis[-1], arm.translation[-1]
    reach = float(np.linalg.norm(arm.translation[1:], axis=1).sum()) or 1.0
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    outwards = 1.0 if axis @ (arm.rotation[-1].T @ step) >= 0.0 else -1.0
    com = reach * (0.1 * across + 0.07 * other + 0.06 * outwards * axis)
    return np.round(com, 3)


def bar(mass: float, com: Array) -> Payload:
    """Return a steel bar of a mass [kg], sides 1 : 1 : 3, the long one along z, centre [m] in the last link's frame."""
    side = (mass / (3.0 * DENSITY)) ** (1.0 / 3.0)
    thick, thin = (float(f"{mass * side**2 * k / 12.0:.4g}") for k in (10.0, 2.0))
    x, y, z = (float(c) for c in com)
    return Payload(mass=mass, com=(x, y, z), inertia=(thick, thick, thin, 0.0, 0.0, 0.0))
