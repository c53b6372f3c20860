"""`run`: a scenario and a seed to a verdict, the four verbs in four lines."""

import time
from dataclasses import dataclass

import numpy as np

from ident.gains import GainEstimate
from ident.identify import identify
from ident.recording import Recording
from scenarios.build import Bench
from scenarios.judge import Verdict, judge
from sim.record import record


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one run of a scenario produced.

    Attributes:
        bench: The prepared scenario.
        seed: Seed of every random number.
        recordings: Unloaded and loaded.
        estimate: The identified gains.
        verdict: Against the truth.
        notes: From identification.
        simulate_s: Wall time of the simulation [s].
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


def run(bench: Bench, seed: int) -> Run:
    """Record both motions, identify, judge.

    Args:
        bench: The prepared scenario.
        seed: Seed of every random number; the same seed gives the same bytes.

    Raises:
        SimulationError: If a motion cannot be carried out.
        IdentificationError: If the recordings cannot be identified at all.
    """
    table = bench.scenario.table
    started = time.perf_counter()
    rngs = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(2)]
    unloaded, loaded = record(bench.experiments, rngs, threads=2)
    recorded = time.perf_counter()
    chosen = table.identification
    estimate, notes = identify(
        unloaded,
        loaded,
        bench.structure,
        bench.payload,
        method=chosen.method,
        observing=chosen.observe,
        gains=chosen.gains,
    )
    identified = time.perf_counter()
    return Run(
        bench=bench,
        seed=seed,
        recordings=(unloaded, loaded),
        estimate=estimate,
        verdict=judge(estimate, bench.true_gain, table.tolerance),
        notes=notes,
        simulate_s=recorded - started,
        identify_s=identified - recorded,
    )
