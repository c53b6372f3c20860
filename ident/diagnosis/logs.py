"""Logs of one arm that are doubted together, observed once; how they are read differently and observed again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ident.diagnosis.comparison import Score, regrouped
from ident.diagnosis.free_model import FreeModel, free_model
from ident.diagnosis.hypothesis import Hypothesis
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.structure import Structure, structure_of
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording
from ident.support.arrays import Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Logs:
    """Logs, and what is compared of them.

    Attributes:
        recordings: The logs.
        problem: Their linear systems.
        observing: Filters.
        spoilt: Samples of each log that no row rests on, shape (N, n); None where there are none.
        model: The free fits.
    """

    recordings: tuple[Recording, ...]
    problem: Problem
    observing: ObserveOptions
    spoilt: tuple[Mask | None, ...]
    model: FreeModel

    @property
    def structure(self) -> Structure:
        """Of the arm."""
        return self.problem.structure

    @property
    def names(self) -> tuple[str, ...]:
        """Of the logs."""
        return tuple(each.name for each in self.recordings)


def observed_logs(
    recordings: Sequence[Recording],
    problem: Problem,
    observing: ObserveOptions,
    spoilt: Sequence[Mask | None] | None = None,
) -> Logs:
    """Logs whose observation is known."""
    return Logs(
        recordings=tuple(recordings),
        problem=problem,
        observing=observing,
        spoilt=tuple(spoilt or (None,) * len(recordings)),
        model=free_model(problem),
    )


def read_as(logs: Logs, hypothesis: Hypothesis) -> Logs:
    """The logs read otherwise and observed again.

    Raises:
        RecordingError: If the logs read so cannot be filtered.
    """
    arm = hypothesis.of_arm(logs.structure.arm)
    structure = logs.structure if arm is logs.structure.arm else structure_of(arm)
    recordings = tuple(how.read(log) for how, log in zip(hypothesis.logs, logs.recordings, strict=True))
    spoilt = tuple(how.read_mask(each) for how, each in zip(hypothesis.logs, logs.spoilt, strict=True))
    motions = tuple(
        motion  # observed before
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
    """Filters that take the same samples together if seconds are a factor of those that a log says."""
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
    """Score of logs read otherwise, by the columns and in the units that they have."""
    return regrouped(score, [each.v_order for each in hypothesis.logs], [each.v_factor for each in hypothesis.logs])
