"""Kinematics that differ from the drawing: frames that lie farther out."""

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
    """Frames, by the name of the distance that leads to them in the robot's file.

    Attributes:
        d3_error: Distance by which frame 3 lies farther from frame 2 than drawn [m].
        r4_error: Distance by which frame 4 lies farther from frame 3 than drawn [m].
    """

    d3_error: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("m")] = 0.0
    r4_error: Annotated[float, Interval(ge=-0.1, le=0.1), Unit("m")] = 0.0

    @property
    def moved(self) -> dict[str, float]:
        """Distances that differ [m], by the name that a robot gives them."""
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
