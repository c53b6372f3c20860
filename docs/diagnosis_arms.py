"""Serial arms of the independent simulator, built in Pinocchio: random, UR-like, SCARA, gantry, spherical wrist."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ident.support.arrays import Array

DOWN = (0.0, 0.0, -9.81)
SPREAD, SLIDE_SPREAD = 1.0, 0.16
"""Largest excursion from the middle of a motion [rad], [m]."""


@dataclass(frozen=True, kw_only=True)
class BuiltArm:
    """An arm, where it moves and what it carries.

    Attributes:
        model: Its links and joints.
        middle: Of its motions [rad or m], shape (n,).
        spread: Largest excursion from there [rad or m], shape (n,).
        mass: Of its payload [kg].
        reach: Distance of the payload's centre of mass from the last frame [m].
        apart: Whether it is kept for judgement.
    """

    model: pin.Model
    middle: Array
    spread: Array
    mass: float
    reach: float
    apart: bool


def _added(
    model: pin.Model,
    axis: Sequence[float],
    place: pin.SE3,
    mass: float,
    com: Sequence[float],
    size: float,
    slides: bool,
) -> None:
    """Append a joint with its link: a lopsided body of radius of gyration of about `size`."""
    unit = np.array(axis, dtype=float) / np.linalg.norm(axis)
    kind = pin.JointModelPrismaticUnaligned(unit) if slides else pin.JointModelRevoluteUnaligned(unit)
    limit = np.array([1.2 if slides else 3.4])
    name = f"joint{model.njoints}"
    index = model.addJoint(
        model.njoints - 1, kind, place, name, np.array([1e4]), np.array([20.0]), -limit, limit
    )  # limits that no motion comes near
    turned = pin.rpy.rpyToMatrix(0.3, -0.5, 0.9)
    inertia = turned @ np.diag([1.2, 1.0, 0.55]) @ turned.T * mass * size**2
    model.appendBodyToJoint(index, pin.Inertia(mass, np.array(com, dtype=float), inertia), pin.SE3.Identity())


def _new(name: str, gravity: tuple[float, float, float] = DOWN) -> pin.Model:
    model = pin.Model()
    model.name = name
    model.gravity = pin.Motion(np.array(gravity), np.zeros(3))
    return model


def _random(name: str, seed: int, n: int, *, slide: int | None = None, apart: bool, mass: float) -> BuiltArm:
    """Axes upright and across by turns, tilted at random; links shorter and lighter towards the flange."""
    rng = np.random.default_rng((2027, seed))
    model = _new(name)
    for k in range(n):
        length = 0.36 * 0.84**k * rng.uniform(0.8, 1.2)
        axis = np.array(((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))[k % 4])
        axis = axis + 0.25 * rng.standard_normal(3)
        xyz = length * np.array([0.25, 0.2, 0.9]) + 0.15 * length * rng.standard_normal(3)
        place = pin.SE3(pin.rpy.rpyToMatrix(*rng.uniform(-0.35, 0.35, 3)), xyz)
        com = 0.4 * length * (np.array([0.1, -0.1, 0.9]) + 0.3 * rng.standard_normal(3))
        _added(model, axis, place, 13.0 * 0.68**k * rng.uniform(0.8, 1.2), com, 0.3 * length, slides=k == slide)
    middle = rng.uniform(-0.8, 0.8, n)
    spread = np.full(n, SPREAD) * rng.uniform(0.7, 1.2, n)
    if slide is not None:
        middle[slide], spread[slide] = 0.05, SLIDE_SPREAD
    return BuiltArm(model=model, middle=middle, spread=spread, mass=mass, reach=0.14, apart=apart)


def _ur_like(name: str, *, gravity: tuple[float, float, float], scale: float, apart: bool, mass: float) -> BuiltArm:
    """Shoulder, two parallel links, a wrist of three axes that do not meet."""
    model = _new(name, gravity)
    turn = pin.utils.rotate("y", np.pi / 2)
    places = [(np.eye(3), (0, 0, 0.16)), (turn, (0, 0.16, 0)), (np.eye(3), (0, -0.12, 0.49))]
    places += [(turn, (0, 0, 0.43)), (np.eye(3), (0, 0.12, 0)), (np.eye(3), (0, 0, 0.1))]
    axes = [(0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0)]
    masses = [6.2, 10.4, 4.1, 1.7, 1.6, 0.5]
    coms = [
        (0.0, -0.03, -0.02),
        (0.01, -0.05, 0.21),
        (0.0, 0.02, 0.2),
        (0.0, 0.02, 0.01),
        (0.0, 0.01, 0.02),
        (0, 0.02, 0.01),
    ]
    sizes = [0.06, 0.17, 0.14, 0.04, 0.04, 0.03]
    for (R, xyz), axis, m, com, size in zip(places, axes, masses, coms, sizes, strict=True):
        _added(
            model,
            axis,
            pin.SE3(R, scale * np.array(xyz, dtype=float)),
            m * scale**2,
            scale * np.array(com),
            scale * size,
            False,
        )
    middle = np.array([0.2, -1.1, 1.2, -0.6, 0.8, 0.3])
    return BuiltArm(model=model, middle=middle, spread=np.full(6, 0.9), mass=mass, reach=0.13, apart=apart)


def _scara() -> BuiltArm:
    """Two upright axes, a slide along gravity, an upright wrist."""
    model = _new("scara")
    rows = [
        ((0, 0, 1), (0.02, 0, 0.3), 8.7),
        ((0, 0, 1), (0.32, 0.01, 0.04), 5.1),
        ((0, 0, 1), (0.23, -0.02, -0.06), 2.3),
    ]
    for k, (axis, xyz, m) in enumerate([*rows, ((0, 0, 1), (0, 0, -0.1), 0.8)]):
        _added(model, axis, pin.SE3(np.eye(3), np.array(xyz, dtype=float)), m, (0.09, 0.02, -0.03), 0.09, slides=k == 2)
    middle, spread = np.array([0.3, 0.9, -0.05, 0.2]), np.array([1.1, 1.0, 0.1, 1.3])
    return BuiltArm(model=model, middle=middle, spread=spread, mass=3.2, reach=0.12, apart=False)


def _gantry() -> BuiltArm:
    """Three slides, one of them tilted by its frame, and a wrist about a level axis that gravity loads."""
    model = _new("gantry")
    rows = [((1, 0, 0), 31.0, True), ((0, 1, 0), 18.0, True), ((0, 0.1, 1), 7.5, True), ((0.1, 1, 0), 1.9, False)]
    for axis, m, slides in rows:
        place = pin.SE3(pin.rpy.rpyToMatrix(0.03, -0.02, 0.05), np.array([0.1, 0.05, 0.2]))
        _added(model, axis, place, m, (0.04, 0.02, -0.05), 0.1, slides)
    middle, spread = np.array([0.0, 0.1, -0.1, 0.4]), np.array([0.35, 0.3, 0.25, 1.2])
    return BuiltArm(model=model, middle=middle, spread=spread, mass=4.6, reach=0.16, apart=True)


def _spherical() -> BuiltArm:
    """A shoulder and an elbow with offsets, a wrist whose axes meet."""
    model = _new("spherical")
    rows = [
        ((0, 0, 1), (0, 0, 0.3), 21.0, (0.03, 0.02, 0.1), 0.12),
        ((0, 1, 0), (0.12, 0, 0.15), 15.0, (0.02, -0.06, 0.22), 0.18),
        ((0, 1, 0), (0, 0, 0.52), 9.0, (0.06, 0.03, 0.08), 0.12),
        ((1, 0, 0), (0.18, 0, 0.08), 4.0, (0.15, 0.0, 0.01), 0.1),
        ((0, 1, 0), (0.33, 0, 0), 1.6, (0.02, 0.01, 0.0), 0.05),
        ((1, 0, 0), (0, 0, 0), 0.6, (0.06, 0.0, 0.01), 0.03),
    ]
    for axis, xyz, m, com, size in rows:
        _added(model, axis, pin.SE3(np.eye(3), np.array(xyz, dtype=float)), m, com, size, False)
    middle, spread = np.array([0.0, 0.3, 0.2, 0.1, 0.6, 0.0]), np.array([1.1, 0.6, 0.7, 1.2, 1.0, 1.3])
    return BuiltArm(model=model, middle=middle, spread=spread, mass=6.5, reach=0.18, apart=True)


ARMS: dict[str, Callable[[], BuiltArm]] = {
    "random5": lambda: _random("random5", 1, 5, apart=False, mass=4.0),
    "random6": lambda: _random("random6", 2, 6, apart=False, mass=3.4),
    "random7": lambda: _random("random7", 3, 7, apart=False, mass=2.7),
    "random6-slide": lambda: _random("random6-slide", 4, 6, slide=2, apart=False, mass=3.1),
    "ur-like": lambda: _ur_like("ur-like", gravity=DOWN, scale=1.0, apart=False, mass=4.4),
    "scara": _scara,
    "random5-apart": lambda: _random("random5-apart", 11, 5, slide=3, apart=True, mass=3.7),
    "random6-apart": lambda: _random("random6-apart", 12, 6, apart=True, mass=3.0),
    "random7-apart": lambda: _random("random7-apart", 13, 7, apart=True, mass=2.4),
    "ur-wall": lambda: _ur_like("ur-wall", gravity=(0.0, -9.81, 0.0), scale=0.8, apart=True, mass=2.9),
    "gantry": _gantry,
    "spherical": _spherical,
}
"""By name; half of them are kept apart."""
