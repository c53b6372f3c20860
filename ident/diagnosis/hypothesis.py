"""Hypotheses on logs: another meaning of their columns, another base, other lengths; and what follows from these.

A `Hypothesis` reads the logs otherwise. An `Alternative` is one that assumes a fault. A small one stands for all sizes,
to first order: columns of currents whose coefficients are its parameters; with values of these it is evaluated exactly.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import PurePath

import numpy as np

from ident.diagnosis.evidence import Fits, Score
from ident.diagnosis.models import free_fits
from ident.estimation.intervals import BLOCKS
from ident.estimation.problem import Columns, ObservedMotion, Problem, joint_rows
from ident.model.arm import Arm, with_transmission
from ident.model.structure import Structure, structure_of
from ident.numerics.signals import delayed
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices, Mask, once_per_object, readonly


@dataclass(frozen=True, kw_only=True, eq=False)
class LogHypothesis:
    """A hypothesis on the columns of a log.

    The arm has `q = q_factor * p + p @ q_mixing.T + zero`, where `p = q_log[:, q_order]`, and
    `v = v_factor * v_log[:, v_order]`; time is `clock` times that of the log, and currents act `delay` earlier than
    they are logged.
    """

    q_factor: Array  # factor of each joint's position, shape (n,)
    q_mixing: Array  # shares of other joints' positions in each, shape (n, n), zero unless they are coupled
    zero: Array  # position of the arm at position 0 of the log [rad or m], shape (n,)
    q_order: Indices  # column of the position of each joint, from 0, shape (n,)
    v_order: Indices  # column of the current of each joint, from 0, shape (n,)
    v_factor: Array  # factor of each joint's current, shape (n,)
    clock: float  # factor of time
    delay: Array  # delay of each joint's logged current [s], shape (n,)

    @cached_property
    def of_positions(self) -> bytes:
        """Key of all that changes positions and their derivatives."""
        parts = (self.q_factor, self.q_mixing, self.zero, self.q_order, np.float64(self.clock))
        return b"".join(each.tobytes() for each in parts)

    def mixed(self, x: Array) -> Array:
        """Return positions, speeds or accelerations of the arm, without zeros, from those of the log, (..., N, n)."""
        ordered = x[..., self.q_order]
        return self.q_factor * ordered + ordered @ self.q_mixing.T if self.q_mixing.any() else self.q_factor * ordered

    def read(self, log: Recording) -> Recording:
        """Return the log under this hypothesis; the same object if nothing changes, and the same arrays."""
        own = np.arange(len(self.zero))
        given_q = (self.q_order == own).all() and (self.q_factor == 1.0).all()
        given_q = given_q and not (self.zero.any() or self.q_mixing.any())
        given_v = (self.v_order == own).all() and (self.v_factor == 1.0).all()
        if given_q and given_v and not self.delay.any() and self.clock == 1.0:
            return log
        t = log.t if self.clock == 1.0 else self.clock * log.t
        q = log.q if given_q else self.mixed(log.q) + self.zero
        v = log.v if given_v else self.v_factor * log.v[:, self.v_order]
        if self.delay.any():
            periods = self.delay / log.period
            v = np.column_stack([delayed(each[:, None], -float(p)) for each, p in zip(v.T, periods, strict=True)])
        return Recording(t, q, v, log.name)

    def read_mask(self, spoilt: Mask | None) -> Mask | None:
        """Mask of spoilt samples of each joint's position or current under this hypothesis, shape (N, n)."""
        if spoilt is None:
            return None
        of_q = spoilt[:, self.q_order]
        return of_q | (of_q @ (self.q_mixing.T != 0.0)) | spoilt[:, self.v_order]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Hypothesis:
    """A hypothesis on several logs of an arm."""

    logs: tuple[LogHypothesis, ...]  # hypothesis on each log
    gravity: Array  # gravity in the base frame [m/s^2], shape (3,)
    length_factors: Array  # factor of the distance between each frame and the preceding one, shape (n,)
    # matrix of motors that several joints turn, shape (n, n); None for that of the arm:
    transmission: Array | None = None

    def of_arm(self, arm: Arm) -> Arm:
        """Return the arm under this hypothesis; the same object if nothing changes."""
        if self.transmission is not None:
            arm = with_transmission(arm, self.transmission)
        if (self.length_factors == 1.0).all() and (self.gravity == arm.gravity).all():
            return arm
        return replace(arm, gravity=self.gravity, translation=self.length_factors[:, None] * arm.translation)

    def changed(self, logs: Sequence[int], **fields: Array | Indices | float) -> "Hypothesis":
        """Return this hypothesis with other fields for some logs."""
        other = {each: replace(each, **fields) for each in dict.fromkeys(self.logs[k] for k in logs)}
        return replace(self, logs=tuple(other[each] if k in logs else each for k, each in enumerate(self.logs)))


@lru_cache(maxsize=8)
def as_logged(arm: Arm, logs: int) -> Hypothesis:
    """Return the hypothesis that logs and model are correct."""
    n, order = arm.n, np.arange(arm.n)
    own = LogHypothesis(
        q_factor=np.ones(n), q_mixing=np.zeros((n, n)), zero=np.zeros(n), q_order=order, v_order=order,
        v_factor=np.ones(n), clock=1.0, delay=np.zeros(n),
    )  # fmt: skip
    return Hypothesis(logs=(own,) * logs, gravity=arm.gravity, length_factors=np.ones(n))


@dataclass(frozen=True, eq=False)
class Logs:
    """Logs that are observed, with a fit of each joint alone."""

    recordings: tuple[Recording, ...]  # the logs
    problem: Problem  # their linear systems; two mountings are two payload objects, even if equal
    observing: ObserveOptions  # filters
    spoilt: tuple[Mask | None, ...]  # mask of samples of each log that no row uses, shape (N, n), or None
    terms: tuple[Array | None, ...] = ()  # further columns of each joint's free fit, shape (r_j, m), if any

    @cached_property
    def rows(self) -> tuple[Columns, ...]:
        """Rows of each joint."""
        return tuple(joint_rows(self.problem, joint) for joint in range(self.structure.arm.n))

    @cached_property
    def fits(self) -> Fits:
        """Each joint's fit by the free model, prepared for held-out predictions."""
        return free_fits(self.problem, self.rows, self.terms)

    @property
    def structure(self) -> Structure:
        """Structure of the arm."""
        return self.problem.structure

    @cached_property
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


@lru_cache(maxsize=1)  # of long logs each has a hundred megabytes
def read_as(logs: Logs, hypothesis: Hypothesis) -> Logs:
    """Return the logs under a hypothesis, observed again; `RecordingError` if they cannot be filtered under it."""
    arm, given = hypothesis.of_arm(logs.structure.arm), logs.observing
    structure = logs.structure if arm is logs.structure.arm else structure_of(arm)
    recordings = tuple(how.read(log) for how, log in zip(hypothesis.logs, logs.recordings, strict=True))
    spoilt = tuple(how.read_mask(each) for how, each in zip(hypothesis.logs, logs.spoilt, strict=True))
    motions = list(logs.problem.motions)
    for k, (log, how) in enumerate(zip(recordings, hypothesis.logs, strict=True)):
        if log is not logs.recordings[k] or structure is not logs.structure:
            observing = replace(  # filters that combine the same samples whatever the clock
                given, cutoff_hz=given.cutoff_hz / how.clock, current_delay=given.current_delay * how.clock,
                decimation_cutoff_hz=given.decimation_cutoff_hz / how.clock,
                rows_per_second=given.rows_per_second / how.clock,
            )  # fmt: skip
            motions[k] = ObservedMotion(observe(log, structure, observing, spoilt[k]), motions[k].payload)
    return Logs(recordings, Problem(structure, tuple(motions), logs.problem.options), given, spoilt)


def scored_as(score: Score, hypothesis: Hypothesis) -> Score:
    """Convert a score under a hypothesis to the columns and units of the logs."""
    squares, rows = np.empty_like(score.squares), np.empty_like(score.rows)
    for k, how in enumerate(hypothesis.logs):
        own = slice(k * BLOCKS, (k + 1) * BLOCKS)
        squares[how.v_order, own] = score.squares[:, own] / how.v_factor[:, None] ** 2
        rows[how.v_order, own] = score.rows[:, own]
    return Score(squares, rows)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Alternative:
    """Another interpretation of logs, which assumes a fault, or a term that the model lacks."""

    family: str  # kind of fault, such as `zero` or `delay`, or of term
    # family of the small alternatives whose parameter is, or is included in, its size; "" if that is its own:
    parameter: str = ""
    words: str  # description, such as `zero of q2 off by +4 degrees in loaded.csv alone`
    joints: tuple[int, ...]  # joints concerned, from 0; empty for all
    logs: tuple[int, ...]  # logs concerned, from 0
    hypothesis: Hypothesis  # the interpretation of the logs; as they are for a term
    advice: str  # the remedy
    value: float | None = None  # size of the fault, None without one
    unit: str | None = None  # unit of the size
    parameters: int = 1  # number of parameters
    # function that returns the same alternative with parameters changed slightly, in units of the columns:
    refined: "Callable[[Array], Alternative] | None" = None
    # function that returns the same with special sizes near it, the simplest first, from deviations of the parameters:
    special: "Callable[[Array], Iterable[Alternative]]" = lambda spread: ()
    searched: bool = False  # whether its size was selected from a grid, so that it has no special value
    # change of each joint's currents per unit of the m parameters, n arrays of shape (r_j, m); None where they are
    # zero; empty for a large alternative:
    columns: tuple[Array | None, ...] = ()
    scale: float = 1.0  # reported value per unit of the columns
    largest: float = np.inf  # largest value of the parameters for which the first order is valid
    # specified standard deviations of the parameters, which the estimate includes, shape (m,):
    prior_std: Array | None = None
    term: bool = False  # whether it adds to the model and does not interpret the logs
    # whether a log or a specified value would be wrong, so that gains may be refused; else the model lacks it, which
    # is only reported:
    at_fault: bool = True

    @property
    def key(self) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """Family of its parameter, joints and logs, which identify it."""
        return self.parameter or self.family, self.joints, self.logs

    def at(self, value: Array) -> "Alternative":
        """Return a small alternative with values of its parameters, shape (m,)."""
        assert self.refined is not None, "small"
        return self.refined(value)

    def of_size(self, value: float, unit: str | None, refined: "Callable[[Array], Alternative]") -> "Alternative":
        """The same with a size, and the function that changes it."""
        return replace(self, value=value, unit=unit, refined=refined)

    def described(self, value: Array, names: Sequence[str]) -> "Alternative":
        """The same, with the logs of a term named in its description; names are those of all logs."""
        found = self.at(value)
        return replace(found, words=in_logs(found.words, self.logs, names)) if self.term else found


def small(
    found: Alternative, columns: Sequence[Array | None], *, scale: float = 1.0, largest: float = np.inf
) -> Alternative:
    """Return small alternatives of all sizes, from that of size zero and columns of currents."""
    width = next(each.shape[1] for each in columns if each is not None)
    return replace(found, columns=tuple(columns), parameters=width, scale=scale, largest=largest)


def scopes(logs: int) -> list[tuple[int, ...]]:
    """All logs together, and each alone."""
    every = tuple(range(logs))
    return [every, *((k,) for k in every)] if logs > 1 else [every]


def in_logs(words: str, logs: Sequence[int], names: Sequence[str]) -> str:
    """Add the names of the logs concerned to a description, unless all are."""
    if len(logs) == len(names):
        return words
    short = names_apart(tuple(names))
    return f"{words} in {' and '.join(short[k] for k in logs)} alone"


@lru_cache(maxsize=8)  # used by hundreds of alternatives of the same logs
def names_apart(names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of files without folders, unless these are needed to distinguish them."""
    short = tuple(PurePath(name).name for name in names)
    return short if len(set(short)) == len(set(names)) else tuple(names)


SLACK = 0.1
"""Excess over a limit that is attributed to an error of the zero [rad or m]."""
TURN = 2.0 * np.pi
STILL = 0.1
"""Range of a joint in exciting motions below which it counts as standing still [rad or m]."""


def beyond_limits(arm: Arm, log: Recording) -> tuple[int, ...]:
    """Joints, from 0, beyond their limits in a log; a revolute joint may be offset by whole turns."""
    low, high = _ends(log)
    return tuple(j for j in range(arm.n) if not _reached(arm, j, low[j], high[j]))


def within_limits(arm: Arm, log: Recording, how: LogHypothesis) -> bool:
    """Whether, under a hypothesis that changes units, all joints are within their limits and move enough."""
    ends = how.q_factor * _ends(log)[:, how.q_order] + how.zero
    low, high = ends.min(axis=0), ends.max(axis=0)
    changed = np.abs(how.q_factor) != 1.0
    return all(_reached(arm, j, low[j], high[j]) and high[j] - low[j] >= STILL for j in range(arm.n) if changed[j])


@once_per_object
def _ends(log: Recording) -> Array:
    """Lowest and highest position of each joint, shape (2, n); some 60 hypotheses per log need them."""
    return readonly(np.array([log.q.min(axis=0), log.q.max(axis=0)]))


def reach(arm: Arm, j: int) -> tuple[float, float]:
    """Lowest and highest position of a joint; of a revolute one at most two turns in either direction."""
    most = 2.0 * TURN if arm.revolute[j] else np.inf
    return max(float(arm.lower[j]), -most), min(float(arm.upper[j]), most)


def whole_turns(lower: float, upper: float, low: float, high: float) -> range:
    """Numbers of turns that shift positions from `low` to `high` into finite limits, with some slack."""
    return range(int(np.ceil((lower - SLACK - low) / TURN)), int(np.floor((upper + SLACK - high) / TURN)) + 1)


def _reached(arm: Arm, j: int, low: float, high: float) -> bool:
    lower, upper = reach(arm, j)
    return len(whole_turns(lower, upper, low, high)) > 0 if arm.revolute[j] else (
        low >= lower - SLACK and high <= upper + SLACK
    )  # fmt: skip
