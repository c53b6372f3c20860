"""From scenario and seed to a verdict: draw, simulate, identify and judge; one run is a study of one trial.

Trials of a study are simulated many in one batch; their recordings do not depend on the batch.
"""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from numbers import Integral
from typing import ClassVar

import numpy as np
from threadpoolctl import threadpool_limits

from ident.estimation.estimate import GainEstimate
from ident.identification import Identification, identify
from ident.preparation import SIMULATED
from ident.recordings.recording import Motion, Recording
from ident.support.errors import IdentificationError, ProjectError
from scenarios.experiments.draws import drawn_settings
from scenarios.experiments.judge import CostVerdict, Verdict, cost_verdict, judge
from scenarios.experiments.scenario import Setup, Value, changed
from scenarios.experiments.schema import grouped
from scenarios.rendering.result import WithResult
from scenarios.support.errors import ScenarioError
from scenarios.support.progress import SILENT, Progress
from sim.errors import SimulationError
from sim.experiment import Experiment
from sim.record import each_record
from sim.robot import DriveTruth
from sim.sensors import noise_streams
from sim.sensors.sensor import NoiseStreams

LOGS_AT_ONCE = 3.2e7
"""Largest size of the logs of a batch [bytes]: eight pairs of 20 s. More at once save 1.6 % of the time at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One run of a scenario."""

    number: int = 0  # from 0
    seed: int  # of its noise, and of its random settings unless `settings` are given
    settings: Mapping[str, Value] | None = None  # by key path; None to draw the random values
    streams: Mapping[str, int] = field(default_factory=dict[str, int])  # seeds of single noises, by name
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    cost: bool = False  # whether the effect of the controller's gains is estimated, if the scenario asks for it

    def __post_init__(self) -> None:
        """Check the seed."""
        if not isinstance(self.seed, Integral) or self.seed < 0:
            raise ScenarioError(f"seed = {self.seed!r}: expected a whole number from 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A trial without an estimate: its error, and its setup and drawn values as far as it came."""

    trial: Trial
    error: Exception
    settings: Mapping[str, Value] = field(default_factory=dict[str, Value])
    setup: Setup | None = None

    @property
    def kind(self) -> str:
        """The name by which studies count the error."""
        name = "MemoryError" if isinstance(self.error, MemoryError) else type(self.error).__name__  # NumPy has its own
        return self.error.kind if isinstance(self.error, ProjectError) else name


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """A simulated trial."""

    trial: Trial = field(repr=False)
    setup: Setup = field(repr=False)  # with drawn values instead of random tables
    settings: Mapping[str, Value]  # the drawn values, by key path
    recordings: tuple[Recording, ...] = field(default=(), repr=False)  # of the motions, in order of time
    check: Recording | None = field(default=None, repr=False)  # of the motion that is not used for identification
    simulate_s: float = 0.0  # wall time, as a share of the batch [s]

    @property
    def seed(self) -> int:
        """Seed of every random number."""
        return self.trial.seed

    @property
    def logs(self) -> tuple[Motion, ...]:
        """The motions for identification, each with its assumed payload."""
        return as_identified(self.setup, self.recordings)

    @property
    def truth(self) -> DriveTruth:
        """The true drives: `truth.gain` [N m / drive unit], shape (n,), friction and offsets.

        A gain that depends on the current is that at the rms current of the first motion with a payload.
        """
        drives = self.setup.plant.drives
        return replace(drives, gain=self.setup.gain_under([each.v for each in self.recordings]))

    @property
    def motions(self) -> tuple[Experiment, ...]:
        """Its motions; the one that is not used for identification is the last one."""
        check = self.setup.check if self.trial.cost else None
        return self.setup.experiments if check is None else (*self.setup.experiments, check)

    def failed(self, error: Exception) -> Failure:
        """Return its failure."""
        return Failure(trial=self.trial, error=error, settings=self.settings, setup=self.setup)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Run(Simulated, WithResult):
    """A trial that is identified and judged."""

    RESULT: ClassVar[str] = "scenarios.results.gains:Result.of_run"
    identification: Identification
    verdict: Verdict
    identify_s: float  # wall time
    cost: CostVerdict | None = None  # effect of the controller's gains, if requested

    def __repr__(self) -> str:
        """Return whether it passed, and the identification."""
        return f"Run of {self.setup.scenario.name}, {'passed' if self.passed else 'FAILED'}\n{self.identification!r}"

    @property
    def estimate(self) -> GainEstimate:
        """The identified gains."""
        return self.identification.estimate

    @property
    def passed(self) -> bool:
        """Whether every joint passed, and the check payload if there is one."""
        return self.verdict.passed and (self.cost is None or self.cost.passed)


def run(setup: Setup, seed: int, *, stages: Progress = SILENT) -> Run:
    """Draw, simulate, identify and judge one trial, and estimate the effect of the controller's gains if requested.

    Raises `ScenarioError` if a random setting cannot be drawn or is not valid, `SimulationError` if a motion cannot be
    carried out, `IdentificationError` if no gain can be identified.
    """
    # One thread: a pair steps in some 30 microseconds, less than the overhead of a second thread.
    with threadpool_limits(1):
        simulated = simulate(setup, seed, cost=True, stages=stages)
        stages.begin("identifying")
        return identified(simulated)


def simulate(setup: Setup, seed: int, *, cost: bool = False, stages: Progress = SILENT) -> Simulated:
    """Draw and simulate one trial; raises as `run`, except errors of identification."""
    (outcome,) = simulate_trials(setup, [Trial(seed=seed, cost=cost)], stages=stages)
    if isinstance(outcome, Failure):
        raise outcome.error
    return outcome


def simulate_trials(
    setup: Setup, trials: Sequence[Trial], *, stages: Progress = SILENT
) -> Iterator[Simulated | Failure]:
    """Draw and simulate trials in batches; yield each or its first error, in any order, one at a time."""
    batch, size = list[Simulated](), 0.0
    for trial in trials:
        settings: Mapping[str, Value] = {}
        try:
            settings = drawn_settings(setup.scenario, trial.seed) if trial.settings is None else trial.settings
            ready = Simulated(trial=trial, setup=changed(setup, settings), settings=settings)
        except (ScenarioError, SimulationError, IdentificationError) as error:
            yield Failure(trial=trial, error=error, settings=settings)
            continue
        own = sum(16.0 * m.trajectory.duration * m.controller.rate_hz * m.trajectory.n for m in ready.motions)
        if batch and size + own > LOGS_AT_ONCE:
            yield from _simulated(batch, stages)
            batch, size = [], 0.0
        batch.append(ready)
        size += own
    if batch:
        yield from _simulated(batch, stages)


def _simulated(batch: Sequence[Simulated], stages: Progress) -> Iterator[Simulated | Failure]:
    started, simulate_s = time.perf_counter(), 0.0
    places = [(i, m) for i, ready in enumerate(batch) for m in range(len(ready.motions))]
    experiments = [each for ready in batch for each in ready.motions]
    streams = [each for b in batch for each in motion_streams(b.seed, b.trial.streams, len(b.motions))]
    waiting: dict[int, dict[int, Recording | SimulationError]] = defaultdict(dict)
    stages.begin("simulating", sum(each.trajectory.duration for each in experiments))
    for k, outcome in each_record(experiments, streams, threads=1, advanced=stages.advance):
        simulate_s = simulate_s or (time.perf_counter() - started) / len(batch)
        i, m = places[k]
        waiting[i][m], ready = outcome, batch[i]
        if len(waiting[i]) < len(ready.motions):
            continue
        found = [outcome for _, outcome in sorted(waiting.pop(i).items())]
        if errors := [each for each in found if isinstance(each, SimulationError)]:
            yield ready.failed(errors[0])
            continue
        used = tuple(each for each in found if isinstance(each, Recording))
        check = used[len(ready.setup.experiments)] if len(used) > len(ready.setup.experiments) else None
        yield replace(ready, recordings=used[: len(ready.setup.experiments)], check=check, simulate_s=simulate_s)


def identified(simulated: Simulated) -> Run:
    """Identify and judge a simulated trial; raises `IdentificationError` if no gain can be identified."""
    setup, started = simulated.setup, time.perf_counter()
    chosen = setup.scenario.table.identification
    found = identify(
        setup.structure,
        simulated.logs,
        method=chosen.method,
        options=chosen.method_options,
        observing=chosen.observe,
        gains=chosen.gains,
        policy=SIMULATED,
    )
    return Run(
        **{each.name: getattr(simulated, each.name) for each in fields(Simulated)},
        identification=found,
        identify_s=time.perf_counter() - started,
        verdict=judge(found.estimate, simulated.truth.gain, setup.scenario.table.tolerance),
        cost=None if simulated.check is None else cost_verdict(setup, found, simulated.check),
    )


def as_identified(setup: Setup, recordings: Sequence[Recording]) -> tuple[Motion, ...]:
    """Return the motions of a scenario in the order of identification, each with its payload."""
    return tuple(Motion(recordings[k], setup.mounted[k]) for k in grouped(setup.protocol))


def motion_streams(seed: int, replaced: Mapping[str, int], motions: int) -> tuple[NoiseStreams, ...]:
    """Return the noise streams of each motion, which do not depend on their number; `replaced` are seeds by name."""

    def children(seed: int) -> list[np.random.Generator]:
        return [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(motions)]

    own = {name: children(each) for name, each in replaced.items()}
    return tuple(
        {**noise_streams(rng), **{name: each[k] for name, each in own.items()}} for k, rng in enumerate(children(seed))
    )
