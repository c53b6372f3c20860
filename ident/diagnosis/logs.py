"""Logs of one arm that are checked together, and their observation under hypotheses.

A hypothesis is another meaning of columns and model: signs, zeros, orders, units, clocks; another base, other lengths.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.diagnosis.comparison import Score, regrouped
from ident.diagnosis.free_model import FreeModel, free_model
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.structure import Structure, structure_of
from ident.numerics.signals import delayed
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices, Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogHypothesis:
    """A hypothesis on the columns of a log.

    The arm has `q = q_factor * q_log[:, q_order] + zero` and `v = v_factor * v_log[:, v_order]`, time is `clock` times
    that of the log, and currents act `delay` earlier than they are logged.

    Attributes:
        q_factor: Factor of each joint's position, shape (n,).
        zero: Position of the arm at position 0 of the log [rad or m], shape (n,).
        q_order: Column of the position of each joint, from 0, shape (n,).
        v_order: Column of the current of each joint, from 0, shape (n,).
        v_factor: Factor of each joint's current, shape (n,).
        clock: Factor of time.
        delay: Delay of each joint's logged current [s], shape (n,).
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
        """Whether the log is used as it is."""
        own = np.arange(len(self.zero))
        in_place = (self.q_order == own).all() and (self.v_order == own).all()
        plain = (self.q_factor == 1.0).all() and (self.v_factor == 1.0).all() and self.clock == 1.0
        return bool(in_place and plain and not self.zero.any() and not self.delay.any())

    def read(self, log: Recording) -> Recording:
        """Return the log under this hypothesis; the same object if nothing changes."""
        if self.changes_nothing:
            return log
        v = self.v_factor * log.v[:, self.v_order]
        t, q = self.clock * log.t, self.q_factor * log.q[:, self.q_order] + self.zero
        if self.delay.any():
            periods = self.delay / log.period
            v = np.column_stack([delayed(each[:, None], -float(p)) for each, p in zip(v.T, periods, strict=True)])
        return Recording(t, q, v, log.name)

    def read_mask(self, spoilt: Mask | None) -> Mask | None:
        """Mask of spoilt samples of each joint's position or current under this hypothesis, shape (N, n)."""
        return None if spoilt is None else spoilt[:, self.q_order] | spoilt[:, self.v_order]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hypothesis:
    """A hypothesis on several logs of an arm.

    Attributes:
        logs: Hypothesis on each log.
        gravity: Gravity in the base frame [m/s^2], shape (3,).
        length_factors: Factor of the distance between each frame and the preceding one, shape (n,).
    """

    logs: tuple[LogHypothesis, ...]
    gravity: Array
    length_factors: Array

    def of_arm(self, arm: Arm) -> Arm:
        """Return the arm under this hypothesis; the same object if nothing changes."""
        if (self.length_factors == 1.0).all() and (self.gravity == arm.gravity).all():
            return arm
        return replace(arm, gravity=self.gravity, translation=self.length_factors[:, None] * arm.translation)

    def changed(self, logs: Sequence[int], **fields: Array | Indices | float) -> "Hypothesis":
        """Return this hypothesis with other fields for some logs."""
        return replace(
            self,
            logs=tuple(replace(each, **fields) if k in logs else each for k, each in enumerate(self.logs)),
        )


@lru_cache(maxsize=8)
def as_logged(arm: Arm, logs: int) -> Hypothesis:
    """Return the hypothesis that logs and model are correct."""
    n, order = arm.n, np.arange(arm.n)
    own = LogHypothesis(
        q_factor=np.ones(n), zero=np.zeros(n), q_order=order, v_order=order, v_factor=np.ones(n), clock=1.0,
        delay=np.zeros(n),
    )  # fmt: skip
    return Hypothesis(logs=(own,) * logs, gravity=arm.gravity, length_factors=np.ones(n))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Logs:
    """Logs with their free model.

    Attributes:
        recordings: The logs.
        problem: Their linear systems.
        observing: Filters.
        spoilt: Mask of samples of each log that no row uses, shape (N, n), or None.
        model: The free fits.
    """

    recordings: tuple[Recording, ...]
    problem: Problem
    observing: ObserveOptions
    spoilt: tuple[Mask | None, ...]
    model: FreeModel

    @property
    def structure(self) -> Structure:
        """Structure of the arm."""
        return self.problem.structure

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the logs."""
        return tuple(each.name for each in self.recordings)

    @property
    def given(self) -> Hypothesis:
        """The hypothesis that logs and model are correct."""
        return as_logged(self.structure.arm, len(self.recordings))

    @property
    def every(self) -> tuple[int, ...]:
        """Indices of all logs, from 0."""
        return tuple(range(len(self.recordings)))


def observed_logs(
    recordings: Sequence[Recording],
    problem: Problem,
    observing: ObserveOptions,
    spoilt: Sequence[Mask | None] | None = None,
) -> Logs:
    """Return logs that are already observed."""
    return Logs(
        recordings=tuple(recordings),
        problem=problem,
        observing=observing,
        spoilt=tuple(spoilt or (None,) * len(recordings)),
        model=free_model(problem),
    )


def read_as(logs: Logs, hypothesis: Hypothesis) -> Logs:
    """Return the logs under a hypothesis, observed again.

    Raises:
        RecordingError: If the logs cannot be filtered under the hypothesis.
    """
    arm = hypothesis.of_arm(logs.structure.arm)
    structure = logs.structure if arm is logs.structure.arm else structure_of(arm)
    recordings = tuple(how.read(log) for how, log in zip(hypothesis.logs, logs.recordings, strict=True))
    spoilt = tuple(how.read_mask(each) for how, each in zip(hypothesis.logs, logs.spoilt, strict=True))
    motions = tuple(
        motion  # already observed
        if log is before and structure is logs.structure
        else ObservedMotion(observe(log, structure, _by_clock(logs.observing, how.clock), left), motion.payload)
        for how, log, before, left, motion in zip(
            hypothesis.logs, recordings, logs.recordings, spoilt, logs.problem.motions, strict=True
        )
    )
    problem = Problem(structure, motions, logs.problem.options)
    return Logs(
        recordings=recordings,
        problem=problem,
        observing=logs.observing,
        spoilt=spoilt,
        model=free_model(problem),
    )


def _by_clock(observing: ObserveOptions, clock: float) -> ObserveOptions:
    """Return filters that combine the same samples if time is multiplied by a factor."""
    if clock == 1.0:
        return observing
    return replace(
        observing,
        cutoff_hz=observing.cutoff_hz / clock,
        decimation_cutoff_hz=observing.decimation_cutoff_hz / clock,
        rows_per_second=observing.rows_per_second / clock,
        current_delay=observing.current_delay * clock,
    )


def scored_as(score: Score, hypothesis: Hypothesis) -> Score:
    """Convert a score under a hypothesis to the columns and units of the logs."""
    return regrouped(score, [each.v_order for each in hypothesis.logs], [each.v_factor for each in hypothesis.logs])
