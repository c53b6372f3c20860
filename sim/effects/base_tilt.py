"""A tilted base: the direction of gravity is rotated by the inverse tilt."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from ident.support.arrays import Array
from sim.effects.effect import Build, Effect, Values


@dataclass(frozen=True, kw_only=True)
class BaseTilt(Values):
    """Tilt of the base about its x axis, then about its rotated y axis.

    Attributes:
        base_tilt_x: Tilt of the base about its x axis [rad].
        base_tilt_y: Tilt of the base about its y axis, applied after that about x [rad].
    """

    base_tilt_x: Annotated[float, Interval(ge=-0.5, le=0.5), Unit("rad")] = 0.0
    base_tilt_y: Annotated[float, Interval(ge=-0.5, le=0.5), Unit("rad")] = 0.0


def _turn_gravity(values: BaseTilt, spec: mujoco.MjSpec, build: Build) -> None:
    if values.base_tilt_x or values.base_tilt_y:
        spec.option.gravity = _tilt(values.base_tilt_x, values.base_tilt_y).T @ spec.option.gravity


def _tilt(x: float, y: float) -> Array:
    """Rotation of the base, shape (3, 3)."""
    cx, sx, cy, sy = np.cos(x), np.sin(x), np.cos(y), np.sin(y)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    return about_x @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])


EFFECT = Effect[BaseTilt](before_compile=_turn_gravity)
