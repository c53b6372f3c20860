"""A scenario and a seed to a verdict: draw, simulate, identify, judge; one trial or many in one batch."""

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
from scenarios.support.stages import SILENT, Stages
from sim.closed_loop import Advanced, no_progress
from sim.drives import DriveTruth
from sim.errors import SimulationError
from sim.experiment import Experiment
from sim.record import each_record
from sim.sensors import noise_streams
from sim.sensors.effect import NoiseStreams


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One run of a scenario.

    Attributes:
        number: From 0.
        seed: Of its noise, and of its random settings unless they are given.
        settings: Values by place; None to draw what the scenario declares random.
        streams: Seeds of single noise streams, by name, in place of those that follow from `seed`.
        labels: What a study wants written into every row.
        cost: Whether what the controller's gains cost is found as well, where the scenario asks for it.
    """

    number: int = 0
    seed: int
    settings: Mapping[str, Value] | None = None
    streams: Mapping[str, int] = field(default_factory=dict[str, int])
    labels: Mapping[str, str] = field(default_factory=dict[str, str])
    cost: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadyTrial:
    """A trial with everything random drawn: its setup has nothing random left, `settings` are by place."""

    trial: Trial
    setup: Setup
    settings: Mapping[str, Value]

    @property
    def experiments(self) -> tuple[Experiment, ...]:
        """Its motions, that which identification does not see last."""
        check = self.setup.check if self.trial.cost else None
        return self.setup.experiments if check is None else (*self.setup.experiments, check)

    @property
    def streams(self) -> tuple[NoiseStreams, ...]:
        """Noise of its motions."""
        return motion_streams(self.trial.seed, self.trial.streams, len(self.experiments))


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one run of a scenario produced.

    Attributes:
        setup: What was simulated, nothing random left in it.
        seed: Seed of every random number.
        recordings: Of the motions, in order of time.
        estimate: The identified gains.
        verdict: Against the truth.
        notes: From identification.
        simulate_s: Wall time of the simulation, its share of the batch [s].
        identify_s: Wall time of the identification [s].
        found: What is said of the estimate.
        prepared: The recordings, as they were estimated from.
        check: Recording of the motion that identification does not see, None where there is none.
        cost: What the controller's gains cost, None where nobody asks.
    """

    setup: Setup
    seed: int
    recordings: tuple[Recording, ...]
    estimate: GainEstimate
    verdict: Verdict
    notes: tuple[str, ...]
    simulate_s: float
    identify_s: float
    found: Diagnosed = field(default_factory=Diagnosed)
    prepared: Prepared | None = None
    check: Recording | None = None
    cost: CostVerdict | None = None

    @property
    def passed(self) -> bool:
        """Whether every joint passed, and the weight that identification did not see."""
        return self.verdict.passed and (self.cost is None or self.cost.passed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """What the robot of one setup logged.

    Attributes:
        setup: Nothing random left in it.
        recordings: Of the motions, in order of time.
        simulate_s: Wall time, its share of the batch [s].
        check: Of the motion that identification does not see, None where there is none.
    """

    setup: Setup
    recordings: tuple[Recording, ...]
    simulate_s: float
    check: Recording | None = None

    @property
    def logs(self) -> tuple[Motion, ...]:
        """The motions as identification is given them, each with the payload that it is believed to carry."""
        return as_identified(self.setup, self.recordings)

    @property
    def truth(self) -> DriveTruth:
        """The drives as they are: `truth.gain` [N m / drive unit], shape (n,), and what they lose."""
        return self.setup.plant.drives


def as_identified(setup: Setup, recordings: Sequence[Recording]) -> tuple[Motion, ...]:
    """The motions of a scenario in the order that identification is given them, each with what it carries."""
    return tuple(Motion(recordings[k], setup.mounted[k]) for k in grouped(setup.protocol))


def run(setup: Setup, seed: int, *, stages: Stages = SILENT) -> Run:
    """Draw what is random, simulate, identify, judge: one trial of `run_batch`, with what its scenario asks for beside.

    Args:
        setup: The scenario's.
        seed: Seed of every random number; the same seed gives the same bytes.
        stages: Told what is under way.

    Raises:
        ScenarioError: If a random setting cannot be drawn or does not fit.
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If the recordings cannot be identified at all.
    """
    ready = ready_trial(setup, Trial(seed=seed, cost=True))
    # A pair steps in some 30 microseconds: to share that with a second thread takes longer, and so do small matrices.
    with threadpool_limits(1):
        ((_, outcome),) = run_batch([ready], threads=1, stages=stages)
    if isinstance(outcome, Run):
        return outcome
    raise outcome


def simulate(setup: Setup, seed: int, *, threads: int = 1) -> Simulated:
    """Draw what is random, and simulate; raises as `run` but for identification."""
    ((_, outcome),) = simulate_batch([ready_trial(setup, Trial(seed=seed))], threads=threads)
    if isinstance(outcome, Simulated):
        return outcome
    raise outcome


def trial_settings(setup: Setup, trial: Trial) -> Mapping[str, Value]:
    """Values of a trial by place, drawn where it has none of its own."""
    return drawn_settings(setup.scenario, trial.seed) if trial.settings is None else trial.settings


def ready_trial(setup: Setup, trial: Trial) -> ReadyTrial:
    """A trial with everything random drawn.

    Raises:
        ScenarioError: If a random setting cannot be drawn or does not fit.
    """
    settings = trial_settings(setup, trial)
    return ReadyTrial(trial=trial, setup=changed(setup, settings), settings=settings)


def motion_streams(seed: int, replaced: Mapping[str, int], motions: int) -> tuple[NoiseStreams, ...]:
    """Noise of each motion; that of the first ones does not depend on how many follow.

    Streams are `replaced` by seeds, by their names in `NoiseStreams`.
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
    """Record the motions of trials in one batch.

    Recordings do not depend on threads, nor on what else is in the batch.

    Yields:
        The place of a trial, with its recordings or the first reason why there are none; one at a time, so that they
        need not be kept.
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
    trials: Sequence[ReadyTrial], *, threads: int, stages: Stages = SILENT
) -> Iterator[tuple[int, Run | SimulationError | IdentificationError]]:
    """Run trials in one batch. Outcomes do not depend on threads, nor on what else is in the batch.

    Yields:
        The place of a trial, with its run or why there is none, one at a time.
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
