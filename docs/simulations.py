"""Recordings of a scenario, seed by seed, as the pages need them: ten at once."""

from collections.abc import Iterator, Sequence

from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.run import Simulated, Trial, ready_trial, simulate_batch
from sim.errors import SimulationError

TOGETHER = 10


def outcomes_of(scenario: str, seeds: Sequence[int]) -> Iterator[tuple[int, Setup, Simulated | SimulationError]]:
    """Each seed, its setup as drawn, and its recordings or why there are none."""
    setup = setup_of(load_scenario(scenario))
    for start in range(0, len(seeds), TOGETHER):
        part = seeds[start : start + TOGETHER]
        ready = [ready_trial(setup, Trial(seed=seed)) for seed in part]
        for k, outcome in simulate_batch(ready, threads=1):
            yield part[k], ready[k].setup, outcome
