"""Recordings of a scenario, seed by seed, as the pages need them: ten at once."""

from collections.abc import Iterator, Sequence

from scenarios.experiments.build import Bench, bench
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.run import Simulated, drawn, motion_streams, simulate_batch
from sim.errors import SimulationError

TOGETHER = 10


def outcomes_of(scenario: str, seeds: Sequence[int]) -> Iterator[tuple[int, Bench, Simulated | SimulationError]]:
    """Each seed, its bench as drawn, and its recordings or why there are none."""
    prepared = bench(load_scenario(scenario))
    for start in range(0, len(seeds), TOGETHER):
        part = seeds[start : start + TOGETHER]
        ready = [drawn(prepared, seed) for seed in part]
        streams = [motion_streams(seed, {}, len(each.experiments)) for seed, each in zip(part, ready, strict=True)]
        for k, outcome in simulate_batch(ready, streams, threads=1):
            yield part[k], ready[k], outcome
