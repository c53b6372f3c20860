"""From scenario and seed to a verdict: draw, simulate, identify and judge one trial or a batch of trials."""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from threadpoolctl import threadpool_limits

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.estimate import GainEstimate
from ident.identification import identify
from ident.preparation import SIMULATED, Prepared
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.errors import IdentificationError
from scenarios.experiments.build import Setup, changed
from scenarios.experiments.cost import cost_verdict
from scenarios.experiments.files.draws import drawn_settings
from scenarios.experiments.files.mountings import grouped
from scenarios.experiments.files.settings import Value
from scenarios.experiments.judge import CostVerdict, Verdict, judge
from scenarios.support.progress import SILENT, Progress
from sim.closed_loop import Advanced, no_progress
from sim.errors import SimulationError
from sim.experiment import Experiment
from sim.record import each_record
from sim.robot import DriveTruth
from sim.sensors import noise_streams
from sim.sensors.sensor import NoiseStreams


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One run of a scenario.

    Attributes:
        number: Number of the trial, from 0.
        seed: Seed of its noise, and of its random settings unless `settings` are given.
        settings: Values by key path; None to draw the random values of the scenario.
        streams: Seeds of single noise streams, by name, which replace those that follow from `seed`.
        labels: Labels that a study writes into every row.
        cost: Whether the effect of the controller's gains is estimated too, if the scenario has a table `cost`.
    """

    number: int = 0
    seed: int
    settings: Mapping[str, Value] | None = None
    streams: Mapping[str, int] = field(default_factory=dict[str, int])
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    cost: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadyTrial:
    """A trial with drawn values: its setup has no random tables, `settings` are by key path."""

    trial: Trial
    setup: Setup
    settings: Mapping[str, Value]

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Its motions; the motion that is not used for identification is the last one."""
        check = self.setup.check if self.trial.cost else None
        return self.setup.experiments if check is None else (*self.setup.experiments, check)

    @property
    def streams(self) -> tuple[NoiseStreams, ...]:
        """Noise streams of its motions."""
        return motion_streams(self.trial.seed, self.trial.streams, len(self.experiments))


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """Result of one run of a scenario.

    Attributes:
        setup: The simulated setup, without random tables.
        seed: Seed of every random number.
        recordings: Recordings of the motions, in order of time.
        estimate: The identified gains.
        verdict: Comparison with the true values.
        notes: Notes of the identification.
        simulate_s: Wall time of the simulation, as a share of the batch [s].
        identify_s: Wall time of the identification [s].
        found: Diagnoses of logs and estimate.
        prepared: The recordings as prepared for the estimate.
        check: Recording of the motion that is not used for identification, None if there is none.
        cost: Effect of the controller's gains, None if not requested.
    """

    setup: Setup = field(repr=False)
    seed: int
    recordings: tuple[Recording, ...] = field(repr=False)
    estimate: GainEstimate
    verdict: Verdict
    notes: tuple[str, ...]
    simulate_s: float
    identify_s: float
    found: Diagnosed = field(default_factory=Diagnosed)
    prepared: Prepared | None = field(default=None, repr=False)
    check: Recording | None = field(default=None, repr=False)
    cost: CostVerdict | None = None

    @property
    def passed(self) -> bool:
        """Whether every joint passed, and the check payload if there is one."""
        return self.verdict.passed and (self.cost is None or self.cost.passed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """Recordings of one setup.

    Attributes:
        setup: The setup, without random tables.
        recordings: Recordings of the motions, in order of time.
        simulate_s: Wall time, as a share of the batch [s].
        check: Recording of the motion that is not used for identification, None if there is none.
    """

    setup: Setup
    recordings: tuple[Recording, ...]
    simulate_s: float
    check: Recording | None = None

    @property
    def logs(self) -> tuple[Motion, ...]:
        """The motions for identification, each with its assumed payload."""
        return as_identified(self.setup, self.recordings)

    @property
    def truth(self) -> DriveTruth:
        """The true drives: `truth.gain` [N m / drive unit], shape (n,), friction and offsets."""
        return self.setup.plant.drives


def as_identified(setup: Setup, recordings: Sequence[Recording]) -> tuple[Motion, ...]:
    """Return the motions of a scenario in the order of identification, each with its payload."""
    return tuple(Motion(recordings[k], setup.mounted[k]) for k in grouped(setup.protocol))


def run(setup: Setup, seed: int, *, stages: Progress = SILENT) -> Run:
    """Draw, simulate, identify and judge one trial, and estimate the effect of the controller's gains if requested.

    Args:
        setup: Setup of the scenario.
        seed: Seed of every random number; the same seed gives the same bytes.
        stages: Display of the current stage.

    Raises:
        ScenarioError: If a random setting cannot be drawn or is not valid.
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If no gain can be identified.
    """
    ready = ready_trial(setup, Trial(seed=seed, cost=True))
    # One thread: a pair steps in some 30 microseconds, less than the overhead of a second thread.
    with threadpool_limits(1):
        ((_, outcome),) = run_batch([ready], threads=1, stages=stages)
    if isinstance(outcome, Run):
        return outcome
    raise outcome


def simulate(setup: Setup, seed: int, *, threads: int = 1) -> Simulated:
    """Draw and simulate; raises as `run`, except errors of identification."""
    ((_, outcome),) = simulate_batch([ready_trial(setup, Trial(seed=seed))], threads=threads)
    if isinstance(outcome, Simulated):
        return outcome
    raise outcome


def trial_settings(setup: Setup, trial: Trial) -> Mapping[str, Value]:
    """Return the values of a trial by key path, drawn unless given."""
    return drawn_settings(setup.scenario, trial.seed) if trial.settings is None else trial.settings


def ready_trial(setup: Setup, trial: Trial) -> ReadyTrial:
    """Return a trial with drawn values.

    Raises:
        ScenarioError: If a random setting cannot be drawn or is not valid.
    """
    settings = trial_settings(setup, trial)
    return ReadyTrial(trial=trial, setup=changed(setup, settings), settings=settings)


def motion_streams(seed: int, replaced: Mapping[str, int], motions: int) -> tuple[NoiseStreams, ...]:
    """Return the noise streams of each motion; they do not depend on the number of motions.

    `replaced` has seeds of single streams, by their names in `NoiseStreams`.
    """
    own = {name: np.random.SeedSequence(each).spawn(motions) for name, each in replaced.items()}
    return tuple(
        noise_streams(np.random.default_rng(child)).replaced(
            {name: np.random.default_rng(children[k]) for name, children in own.items()}
        )
        for k, child in enumerate(np.random.SeedSequence(seed).spawn(motions))
    )


def simulate_batch(
    trials: Sequence[ReadyTrial], *, threads: int, advanced: Advanced = no_progress
) -> Iterator[tuple[int, Simulated | SimulationError]]:
    """Simulate the motions of trials in one batch.

    Recordings depend neither on threads nor on other trials of the batch.

    Yields:
        Index of a trial, with its recordings or its first error; one at a time, to save memory.
    """
    started = time.perf_counter()
    experiments = [experiment for each in trials for experiment in each.experiments]
    places = [(i, m) for i, each in enumerate(trials) for m in range(len(each.experiments))]
    waiting: dict[int, dict[int, Recording | SimulationError]] = defaultdict(dict)
    simulate_s = 0.0
    streams = [stream for each in trials for stream in each.streams]
    for k, outcome in each_record(experiments, streams, threads=threads, advanced=advanced):
        simulate_s = simulate_s or (time.perf_counter() - started) / len(trials)
        i, motion = places[k]
        waiting[i][motion] = outcome
        if len(waiting[i]) == len(trials[i].experiments):
            complete = waiting.pop(i)
            yield i, _simulated(trials[i].setup, [complete[m] for m in sorted(complete)], simulate_s)


def run_batch(
    trials: Sequence[ReadyTrial], *, threads: int, stages: Progress = SILENT
) -> Iterator[tuple[int, Run | SimulationError | IdentificationError]]:
    """Run trials in one batch. Outcomes depend neither on threads nor on other trials of the batch.

    Yields:
        Index of a trial, with its run or its error, one at a time.
    """
    stages.begin("simulating", sum(motion.trajectory.duration for each in trials for motion in each.experiments))
    for i, outcome in simulate_batch(trials, threads=threads, advanced=stages.advance):
        if isinstance(outcome, Simulated):
            stages.begin("identifying")
            yield i, _identified(outcome, trials[i].trial.seed)
        else:
            yield i, outcome


def _simulated(
    setup: Setup, outcomes: Sequence[Recording | SimulationError], simulate_s: float
) -> Simulated | SimulationError:
    recordings: list[Recording] = []
    for outcome in outcomes:
        if isinstance(outcome, SimulationError):
            return outcome
        recordings.append(outcome)
    identified, more = recordings[: len(setup.experiments)], recordings[len(setup.experiments) :]
    check = more[0] if more else None
    return Simulated(setup=setup, recordings=tuple(identified), simulate_s=simulate_s, check=check)


def _identified(simulated: Simulated, seed: int) -> Run | IdentificationError:
    setup, started = simulated.setup, time.perf_counter()
    table = setup.scenario.table
    chosen = table.identification
    try:
        found = identify(
            setup.structure,
            simulated.logs,
            method=chosen.method,
            options=chosen.method_options,
            observing=chosen.observe,
            gains=chosen.gains,
            policy=SIMULATED,
        )
        identify_s = time.perf_counter() - started
        cost = None if simulated.check is None else cost_verdict(setup, found, simulated.check)
    except IdentificationError as error:
        return error
    return Run(
        setup=setup,
        seed=seed,
        recordings=simulated.recordings,
        estimate=found.estimate,
        verdict=judge(found.estimate, setup.true_gain, table.tolerance, expectation=setup.scenario.expectation),
        notes=found.notes,
        simulate_s=simulated.simulate_s,
        identify_s=identify_s,
        found=found.found,
        prepared=found.prepared,
        check=simulated.check,
        cost=cost,
    )
