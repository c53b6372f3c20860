"""Processor time of one run, of trials by the size of their batch, and of predictions, printed; run by `make bench`.

Time of the processor, of which a busy machine takes away less than of wall time; one thread. Medians of several.
"""

import statistics
import time
from collections.abc import Callable

from threadpoolctl import threadpool_limits

from scenarios.experiments.run import run
from scenarios.experiments.scenario import load_scenario, with_method
from scenarios.experiments.setup import setup_of
from scenarios.experiments.trials import Trial, run_trials, trial_schema
from scenarios.prediction.budget import predicted_budget

SCENARIOS = ("nominal", "field", "panda")
BATCHES = {1: 3, 8: 3, 32: 1}
"""Trials at once, and how often."""
RUNS = 3


def processor_s(action: Callable[[], object], times: int = RUNS) -> float:
    """Median of the processor time of calls [s]."""
    spent = []
    for _ in range(times):
        started = time.process_time()
        action()
        spent.append(time.process_time() - started)
    return statistics.median(spent)


def runs_and_trials(name: str) -> None:
    """Of one scenario, recording and identification together, and identification alone."""
    scenario = load_scenario(name)
    setup, schema = setup_of(scenario), trial_schema(scenario, (), ())
    first = run(setup, 0)  # imports, tables
    one = processor_s(lambda: run(setup, 1))
    print(f"{name}, {len(first.estimate.joints)} joints: a run takes {one:.2f} s; a trial", end="")
    for size, times in BATCHES.items():
        batch = [Trial(number=k, seed=k) for k in range(size)]
        whole = processor_s(lambda batch=batch: run_trials(scenario, batch, schema, threads=1), times)
        print(f"{' ' if size == 1 else ', '}{whole / size:.2f} s in a batch of {size}", end="")
    print()


def predictions(method: str) -> None:
    """Of the error budget of `nominal`."""
    scenario = with_method(load_scenario("nominal"), method, [])
    first = processor_s(lambda: predicted_budget(scenario), 1)
    again = processor_s(lambda: predicted_budget(scenario))
    print(f"prediction for nominal, {method}: {first:.2f} s, again {again:.2f} s")


if __name__ == "__main__":
    with threadpool_limits(1):
        for each in ("ls-2011", "nls"):
            predictions(each)
        for each in SCENARIOS:
            runs_and_trials(each)
