"""How logs may be read instead of what they say: signs, zeros, orders, units, clocks; another base or other lengths."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.model.arm import Arm
from ident.numerics.signals import delayed
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices, Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogHypothesis:
    """One way to read the columns of a log.

    The arm has `q = q_factor * q_log[:, q_order] + zero` and `v = v_factor * v_log[:, v_order]`, seconds are `clock`
    times those of the log, and currents act `delay` earlier than they are logged.

    Attributes:
        q_factor: Of each joint's position, shape (n,).
        zero: Position of the arm where the log says 0 [rad or m], shape (n,).
        q_order: Column of the position of each joint, from 0, shape (n,).
        v_order: Column of the current of each joint, from 0, shape (n,).
        v_factor: Of each joint's current, shape (n,).
        clock: Factor of the seconds.
        delay: How late each joint's current is logged [s], shape (n,).
    """

    q_factor: Array
    zero: Array
    q_order: Indices
    v_order: Indices
    v_factor: Array
    clock: float
    delay: Array

    @property
    def changes_nothing(self) -> bool:
        """Whether the log is read as it is."""
        own = np.arange(len(self.zero))
        in_place = (self.q_order == own).all() and (self.v_order == own).all()
        plain = (self.q_factor == 1.0).all() and (self.v_factor == 1.0).all() and self.clock == 1.0
        return bool(in_place and plain and not self.zero.any() and not self.delay.any())

    def read(self, log: Recording) -> Recording:
        """The log read so; the same object where nothing changes."""
        if self.changes_nothing:
            return log
        v = self.v_factor * log.v[:, self.v_order]
        t, q = self.clock * log.t, self.q_factor * log.q[:, self.q_order] + self.zero
        if self.delay.any():
            periods = self.delay / log.period
            v = np.column_stack([delayed(each[:, None], -float(p)) for each, p in zip(v.T, periods, strict=True)])
        return Recording(t, q, v, log.name)

    def read_mask(self, spoilt: Mask | None) -> Mask | None:
        """The samples of each joint's position or current that are spoilt in the log read so, shape (N, n)."""
        return None if spoilt is None else spoilt[:, self.q_order] | spoilt[:, self.v_order]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hypothesis:
    """One way to read several logs of an arm.

    Attributes:
        logs: How each log is read.
        gravity: In the base frame [m/s^2], shape (3,).
        length_factors: Factor of the distance of each frame from the one before, shape (n,).
    """

    logs: tuple[LogHypothesis, ...]
    gravity: Array
    length_factors: Array

    def of_arm(self, arm: Arm) -> Arm:
        """The arm read so; itself where nothing of it differs."""
        if (self.length_factors == 1.0).all() and (self.gravity == arm.gravity).all():
            return arm
        return replace(arm, gravity=self.gravity, translation=self.length_factors[:, None] * arm.translation)

    def changed(self, logs: Sequence[int], **fields: Array | Indices | float) -> "Hypothesis":
        """This hypothesis with other fields of some logs."""
        return replace(
            self,
            logs=tuple(replace(each, **fields) if k in logs else each for k, each in enumerate(self.logs)),
        )


@lru_cache(maxsize=8)
def as_logged(arm: Arm, logs: int) -> Hypothesis:
    """What the logs and the model say."""
    n, order = arm.n, np.arange(arm.n)
    own = LogHypothesis(
        q_factor=np.ones(n), zero=np.zeros(n), q_order=order, v_order=order, v_factor=np.ones(n), clock=1.0,
        delay=np.zeros(n),
    )  # fmt: skip
    return Hypothesis(logs=(own,) * logs, gravity=arm.gravity, length_factors=np.ones(n))
