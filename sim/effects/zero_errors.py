"""Errors of the joints' zeros: encoder readings are offset from the joint angles."""

from dataclasses import dataclass

import mujoco
import numpy as np

from sim.drives import DriveTruth
from sim.effects.effect import Build, Effect, Values
from sim.errors import EffectError
from sim.robot import Robot

LARGEST = 0.5
"""Largest error of a zero [rad or m]."""


@dataclass(frozen=True, kw_only=True)
class ZeroErrors(Values):
    """Errors of the joints' zeros.

    Attributes:
        zero_error: Encoder reading of each joint at its true zero [rad, m for prismatic joints]; None for no error.
    """

    zero_error: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the errors.

        Raises:
            EffectError: If an error is out of range.
        """
        super().__post_init__()
        if self.zero_error is not None and not all(abs(each) <= LARGEST for each in self.zero_error):
            raise EffectError(
                f"errors: zero_error = {list(self.zero_error)} rad: expected numbers between {-LARGEST:g} and "
                f"{LARGEST:g}, one per joint"
            )


def _fits(values: ZeroErrors, robot: Robot, drives: DriveTruth) -> None:
    if values.zero_error is not None and len(values.zero_error) != robot.n:
        raise EffectError(
            f"errors: zero_error: {len(values.zero_error)} values [rad], expected {robot.n}, one per joint"
        )


def _move_zeros(values: ZeroErrors, spec: mujoco.MjSpec, build: Build) -> None:
    for joint, error in zip(spec.joints, values.zero_error or (), strict=False):
        in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
        joint.ref += float(np.degrees(error)) if in_degrees else error


EFFECT = Effect[ZeroErrors](fits=_fits, before_compile=_move_zeros)
