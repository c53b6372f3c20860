"""`run`: a scenario and a seed to a verdict, the four verbs in four lines; many of them in one batch."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ident.errors import IdentificationError
from ident.estimate import GainEstimate
from ident.identification import identify
from ident.recording import Recording
from ident.wiring import known_wiring
from scenarios.build import Bench, bench
from scenarios.files.draws import drawn_settings
from scenarios.files.schema import Scenario, load_scenario
from scenarios.files.settings import with_settings
from scenarios.judge import Verdict, judge
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
        recordings: Unloaded and loaded.
        estimate: The identified gains.
        verdict: Against the truth.
        notes: From identification.
        simulate_s: Wall time of the simulation, its share of the batch [s].
        identify_s: Wall time of the identification [s].
    """

    bench: Bench
    seed: int
    recordings: tuple[Recording, Recording]
    estimate: GainEstimate
    verdict: Verdict
    notes: tuple[str, ...]
    simulate_s: float
    identify_s: float


def run(prepared: Bench, seed: int) -> Run:
    """Draw what is random, record both motions, identify, judge.

    Args:
        prepared: The prepared scenario.
        seed: Seed of every random number; the same seed gives the same bytes.

    Raises:
        ScenarioError: If a random setting cannot be drawn or does not fit.
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If the recordings cannot be identified at all.
    """
    ((_, outcome),) = run_batch([(drawn(prepared, seed), seed)], [pair_streams(seed, {})], threads=2)
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


def pair_streams(seed: int, replaced: Mapping[str, int]) -> tuple[NoiseStreams, NoiseStreams]:
    """Noise of the unloaded and of the loaded motion.

    Args:
        seed: Of the run.
        replaced: Seeds of single streams, by name in `NoiseStreams`, in place of what follows from `seed`.
    """
    unloaded, loaded = (
        noise_streams(np.random.default_rng(np.random.SeedSequence(seed).spawn(2)[k])).replaced(
            {name: np.random.default_rng(np.random.SeedSequence(own).spawn(2)[k]) for name, own in replaced.items()}
        )
        for k in range(2)
    )
    return unloaded, loaded


def run_batch(
    benches: Sequence[tuple[Bench, int]], streams: Sequence[tuple[NoiseStreams, NoiseStreams]], *, threads: int
) -> Iterator[tuple[int, Run | SimulationError | IdentificationError]]:
    """Run prepared scenarios in one batch.

    Args:
        benches: Nothing random left in them, each with the seed it stands for.
        streams: Noise of the two motions of each.
        threads: Threads to step with; outcomes do not depend on it, nor on what else is in the batch.

    Yields:
        The number of a bench, with its run or why there is none; one at a time, so that recordings need not be kept.
    """
    started = time.perf_counter()
    experiments = [experiment for prepared, _ in benches for experiment in prepared.experiments]
    waiting: dict[int, Recording | SimulationError] = {}
    simulate_s = 0.0
    for k, outcome in each_record(experiments, [stream for pair in streams for stream in pair], threads=threads):
        simulate_s = simulate_s or (time.perf_counter() - started) / len(benches)
        if k ^ 1 not in waiting:  # experiments 2 i and 2 i + 1 are a pair
            waiting[k] = outcome
            continue
        other = waiting.pop(k ^ 1)
        pair = (other, outcome) if k % 2 else (outcome, other)
        yield k // 2, _identified(*benches[k // 2], pair, simulate_s)


def _identified(
    prepared: Bench, seed: int, pair: tuple[Recording | SimulationError, Recording | SimulationError], simulate_s: float
) -> Run | SimulationError | IdentificationError:
    unloaded, loaded = pair
    if isinstance(unloaded, SimulationError):
        return unloaded
    if isinstance(loaded, SimulationError):
        return loaded
    table, started = prepared.scenario.table, time.perf_counter()
    chosen = table.identification
    try:
        found = identify(
            unloaded,
            loaded,
            prepared.structure,
            prepared.payload,
            method=chosen.method,
            options=chosen.method_options,
            observing=chosen.observe,
            gains=chosen.gains,
            wiring=known_wiring,
        )
    except IdentificationError as error:
        return error
    identify_s = time.perf_counter() - started
    return Run(
        bench=prepared,
        seed=seed,
        recordings=(unloaded, loaded),
        estimate=found.estimate,
        verdict=judge(found.estimate, prepared.true_gain, table.tolerance, expectation=prepared.scenario.expectation),
        notes=found.notes,
        simulate_s=simulate_s,
        identify_s=identify_s,
    )
