"""Gravity that differs from the model's: a base on a wall, on a ceiling or tilted; or gravity-compensated currents."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_rows
from ident.diagnosis.fitted_currents import Reference, across
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

SAME = 1e-6
"""Difference of unit vectors below which directions of gravity are equal."""
LARGEST = np.deg2rad(15.0)
"""Largest tilt for which the first order is valid [rad]."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Gravity along the axes of the base frame and halfway between them."""
    arm = logs.structure.arm
    size = float(np.linalg.norm(arm.gravity))
    for corner in product((0.0, 1.0, -1.0), repeat=3):
        length = float(np.linalg.norm(corner))
        if length and size:
            gravity = np.array(corner) * size / length
            if np.abs(gravity - arm.gravity).max() > SAME * size:
                where = f"({', '.join(f'{x:g}' for x in corner)})"
                yield _standing(
                    logs, gravity, f"the base is oriented differently: gravity points along {where} of its frame"
                )


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """The base tilted slightly about two horizontal axes."""
    arm = logs.structure.arm
    if not arm.gravity.any():
        return
    parts = [motion.rows(motion.tilted()) for motion in reference.motions]
    yield Direction(
        family="base", joints=(), logs=logs.every, columns=in_rows(parts, logs.every),
        alternative=lambda value: tilted(logs, value),
        unit="degrees", scale=180.0 / np.pi, largest=LARGEST,
    )  # fmt: skip


def tilted(logs: Logs, turn: Array) -> Alternative:
    """Return the base rotated about two horizontal axes.

    Args:
        logs: The logs.
        turn: Angle about each axis [rad], shape (2,).
    """
    gravity = logs.structure.arm.gravity
    axes, angle = across(logs.structure.arm), float(np.linalg.norm(turn))
    axis = axes.T @ turn / angle if angle > 0.0 else axes[0]
    about = ", ".join(f"{x:.2g}" for x in axis + 0.0)
    words = f"the base is tilted by {np.rad2deg(angle):.2g} degrees about ({about})"

    def refined(more: Array) -> Alternative:
        return tilted(logs, turn + more)

    standing = _standing(logs, _rotated(gravity, axis, angle), words)
    return replace(standing, value=float(np.rad2deg(angle)), unit="degrees", refined=refined)


def compensated(logs: Logs) -> Iterator[Alternative]:
    """Links and payload without weight: the controller has subtracted the gravity torque."""
    if logs.structure.arm.gravity.any():
        yield Alternative(
            family="gravity compensation",
            words="v is gravity-compensated: it lacks the weight of links and payload",
            joints=(),
            logs=logs.every,
            hypothesis=replace(logs.given, gravity=np.zeros(3)),
            advice="log the motor current, or the whole commanded torque",
        )


def _standing(logs: Logs, gravity: Array, words: str) -> Alternative:
    return Alternative(
        family="base",
        words=words,
        joints=(),
        logs=logs.every,
        hypothesis=replace(logs.given, gravity=gravity),
        advice="correct the orientation of the base in the model (gravity in its frame)",
    )


def _rotated(x: Array, axis: Array, angle: float) -> Array:
    """A vector rotated about a unit axis (Rodrigues)."""
    c, s = np.cos(angle), np.sin(angle)
    return c * x + s * np.cross(axis, x) + (1.0 - c) * float(axis @ x) * axis
