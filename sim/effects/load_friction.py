"""Dry friction that grows with the torque a drive transmits: `load_friction |g (v - v0)|`, on the drive's own joint."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Interval

from sim.effects.effect import Build, ControlStep, Effect, Term, Values


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Values):
    """Load-dependent dry friction.

    Attributes:
        load_friction: Dry friction per unit of drive torque |g (v - v0)|.
    """

    load_friction: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.0


def _term(values: Sequence[LoadFriction], builds: Sequence[Build]) -> Term:
    per_current = np.stack([v.load_friction * np.abs(b.drives.gain) for v, b in zip(values, builds, strict=True)])
    offset = np.stack([np.asarray(b.drives.amplifier_offset, dtype=np.float64) for b in builds])  # (B, n)

    def add(step: ControlStep) -> None:
        step.friction[:, : offset.shape[1]] += per_current * np.abs(step.v - offset)

    return add


def _varies(values: LoadFriction) -> bool:
    return values.load_friction > 0.0


EFFECT = Effect[LoadFriction](varies=_varies, term=_term, instant=True)
