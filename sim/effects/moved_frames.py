"""Kinematics that differ from the model file: shifted frames."""

from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from annotated_types import Interval, Unit

from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect, Values
from sim.errors import EffectError
from sim.robot import Robot


@dataclass(frozen=True, kw_only=True)
class MovedFrames(Values):
    """Errors of distances between frames; the robot file names the frames.

    Attributes:
        d3_error: Error of the distance from frame 2 to frame 3 [m].
        r4_error: Error of the distance from frame 3 to frame 4 [m].
    """

    d3_error: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("m")] = 0.0
    r4_error: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("m")] = 0.0

    @property
    def moved(self) -> dict[str, float]:
        """Return the nonzero errors of distances [m], by their names in the robot file."""
        return {name: error for name, error in (("d3", self.d3_error), ("r4", self.r4_error)) if error}


def _has_frames(values: MovedFrames, robot: Robot, drives: DriveTruth) -> None:
    for name, error in values.moved.items():
        if name not in robot.frames:
            raise EffectError(f"errors: {name}_error = {error:g} m: {robot.name} has no frame {name}; leave it at 0")


def _move_frames(values: MovedFrames, spec: mujoco.MjSpec, build: Build) -> None:
    for name, error in values.moved.items():
        body = spec.body(build.robot.frames[name])
        if body is None:
            raise EffectError(
                f"errors: {name}_error = {error:g} m: {build.robot.model} has no body {build.robot.frames[name]!r}"
            )
        drawn = float(np.linalg.norm(body.pos))
        if not drawn or drawn + error <= 0.0:
            raise EffectError(
                f"errors: {name}_error = {error:g} m: {body.name} is {drawn:g} m from its parent in the "
                "model; leave it at 0"
            )
        body.pos = (1.0 + error / drawn) * body.pos


EFFECT = Effect[MovedFrames](fits=_has_frames, before_compile=_move_frames)
