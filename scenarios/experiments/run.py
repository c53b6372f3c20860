"""`run`: a scenario and a seed to a verdict, the four verbs in four lines; many of them in one batch."""

import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.estimate import GainEstimate
from ident.identification import identify_motions
from ident.preparation import SIMULATED, Prepared
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.errors import IdentificationError
from scenarios.experiments.build import Bench, bench
from scenarios.experiments.files.draws import drawn_settings
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.mountings import grouped
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.files.settings import with_settings
from scenarios.experiments.judge import Verdict, judge
from scenarios.support.stages import SILENT, Stages
from sim.closed_loop import Advanced, no_progress
from sim.errors import SimulationError
from sim.record import each_record
from sim.sensors import noise_streams
from sim.sensors.effect import NoiseStreams


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one run of a scenario produced.

    Attributes:
        bench: The prepared scenario, what was random drawn.
        seed: Seed of every random number.
        recordings: Of the motions, in order of time.
        estimate: The identified gains.
        verdict: Against the truth.
        notes: From identification.
        simulate_s: Wall time of the simulation, its share of the batch [s].
        identify_s: Wall time of the identification [s].
        found: What is said of the estimate.
        prepared: The recordings, as they were estimated from.
    """

    bench: Bench
    seed: int
    recordings: tuple[Recording, ...]
    estimate: GainEstimate
    verdict: Verdict
    notes: tuple[str, ...]
    simulate_s: float
    identify_s: float
    found: Diagnosed = field(default_factory=Diagnosed)
    prepared: Prepared | None = None


def run(prepared: Bench, seed: int, *, stages: Stages = SILENT) -> Run:
    """Draw what is random, record the motions, identify, judge.

    Args:
        prepared: The prepared scenario.
        seed: Seed of every random number; the same seed gives the same bytes.
        stages: Told what is under way.

    Raises:
        ScenarioError: If a random setting cannot be drawn or does not fit.
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If the recordings cannot be identified at all.
    """
    ready = drawn(prepared, seed)
    streams = motion_streams(seed, {}, len(ready.experiments))
    # A pair steps in some 30 microseconds: to share that with a second thread takes longer.
    stages.begin("simulating", sum(each.trajectory.duration for each in ready.experiments))
    ((_, simulated),) = simulate_batch([ready], [streams], threads=1, advanced=stages.advance)
    if not isinstance(simulated, Simulated):
        raise simulated
    stages.begin("identifying")
    outcome = _identified(ready, seed, simulated)
    if isinstance(outcome, Run):
        return outcome
    raise outcome


def run_scenario(scenario: str | Scenario, seed: int = 0) -> Run:
    """Run a scenario, as `rx90 run` does.

    Args:
        scenario: A built-in name, the path of a TOML file, or what `load_scenario` gave.
        seed: Seed of every random number; the same seed gives the same bytes.

    Raises:
        ScenarioError: If the scenario is wrong.
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If the recordings cannot be identified at all.
    """
    return run(bench(load_scenario(scenario) if isinstance(scenario, str) else scenario), seed)


def drawn(prepared: Bench, seed: int) -> Bench:
    """The bench with everything random drawn for one seed."""
    settings = drawn_settings(prepared.scenario, seed)
    return bench(with_settings(prepared.scenario, settings)) if settings else prepared


def motion_streams(seed: int, replaced: Mapping[str, int], motions: int) -> tuple[NoiseStreams, ...]:
    """Noise of each motion; that of the first ones does not depend on how many follow.

    Args:
        seed: Of the run.
        replaced: Seeds of single streams, by name in `NoiseStreams`, in place of what follows from `seed`.
        motions: Their number.
    """
    own = {name: np.random.SeedSequence(each).spawn(motions) for name, each in replaced.items()}
    return tuple(
        noise_streams(np.random.default_rng(child)).replaced(
            {name: np.random.default_rng(children[k]) for name, children in own.items()}
        )
        for k, child in enumerate(np.random.SeedSequence(seed).spawn(motions))
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """What the cell of one prepared scenario logged.

    Attributes:
        recordings: Of the motions, in order of time.
        simulate_s: Wall time, its share of the batch [s].
    """

    recordings: tuple[Recording, ...]
    simulate_s: float


def simulate_batch(
    benches: Sequence[Bench],
    streams: Sequence[Sequence[NoiseStreams]],
    *,
    threads: int,
    advanced: Advanced = no_progress,
) -> Iterator[tuple[int, Simulated | SimulationError]]:
    """Record the motions of prepared scenarios in one batch.

    Args:
        benches: Nothing random left in them.
        streams: Noise of the motions of each.
        threads: Threads to step with; recordings do not depend on it, nor on what else is in the batch.
        advanced: Told how much is simulated.

    Yields:
        The number of a bench, with its recordings or the first reason why there are none; one at a time, so that they
        need not be kept.
    """
    started = time.perf_counter()
    experiments = [experiment for prepared in benches for experiment in prepared.experiments]
    places = [(i, m) for i, prepared in enumerate(benches) for m in range(len(prepared.experiments))]
    waiting: dict[int, dict[int, Recording | SimulationError]] = defaultdict(dict)
    simulate_s = 0.0
    all_streams = [stream for each in streams for stream in each]
    for k, outcome in each_record(experiments, all_streams, threads=threads, advanced=advanced):
        simulate_s = simulate_s or (time.perf_counter() - started) / len(benches)
        i, motion = places[k]
        waiting[i][motion] = outcome
        if len(waiting[i]) == len(benches[i].experiments):
            complete = waiting.pop(i)
            yield i, _simulated([complete[m] for m in sorted(complete)], simulate_s)


def run_batch(
    benches: Sequence[tuple[Bench, int]],
    streams: Sequence[Sequence[NoiseStreams]],
    *,
    threads: int,
) -> Iterator[tuple[int, Run | SimulationError | IdentificationError]]:
    """Run prepared scenarios in one batch.

    Args:
        benches: Nothing random left in them, each with the seed it stands for.
        streams: Noise of the motions of each.
        threads: Threads to step with; outcomes do not depend on it, nor on what else is in the batch.

    Yields:
        The number of a bench, with its run or why there is none, one at a time.
    """
    for i, outcome in simulate_batch([prepared for prepared, _ in benches], streams, threads=threads):
        yield i, _identified(*benches[i], outcome) if isinstance(outcome, Simulated) else outcome


def as_identified(prepared: Bench, recordings: Sequence[Recording]) -> tuple[Motion, ...]:
    """The motions of a scenario in the order that identification is given them, each with what it carries.

    Args:
        prepared: The scenario.
        recordings: Of its motions, in order of time.
    """
    return tuple(Motion(recordings[k], prepared.mounted[k]) for k in grouped(prepared.protocol))


def _simulated(outcomes: Sequence[Recording | SimulationError], simulate_s: float) -> Simulated | SimulationError:
    recordings: list[Recording] = []
    for outcome in outcomes:
        if isinstance(outcome, SimulationError):
            return outcome
        recordings.append(outcome)
    return Simulated(recordings=tuple(recordings), simulate_s=simulate_s)


def _identified(prepared: Bench, seed: int, simulated: Simulated) -> Run | IdentificationError:
    table, started = prepared.scenario.table, time.perf_counter()
    chosen = table.identification
    try:
        found = identify_motions(
            as_identified(prepared, simulated.recordings),
            prepared.structure,
            method=chosen.method,
            options=chosen.method_options,
            observing=chosen.observe,
            gains=chosen.gains,
            policy=SIMULATED,
        )
    except IdentificationError as error:
        return error
    identify_s = time.perf_counter() - started
    return Run(
        bench=prepared,
        seed=seed,
        recordings=simulated.recordings,
        estimate=found.estimate,
        verdict=judge(found.estimate, prepared.true_gain, table.tolerance, expectation=prepared.scenario.expectation),
        notes=found.notes,
        simulate_s=simulated.simulate_s,
        identify_s=identify_s,
        found=found.found,
        prepared=found.prepared,
    )
