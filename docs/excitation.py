"""Prints a table: the best of 200 random motions and a searched one, on every built-in robot."""

import sys
import time

import numpy as np
from threadpoolctl import threadpool_limits

from scenarios.build import cell
from scenarios.design.excitation import Design
from scenarios.design.problem import design_problem
from scenarios.design.search import STEP, Judge, Series, judge_in, random_point, search
from scenarios.design.start import starts
from scenarios.files.loading import load_scenario
from scenarios.workers.processes import local_processes, usable_cores
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory

SCENARIOS = ("nominal", "mass-only", "ur10e", "tx40", "panda", "stanford")
RANDOM = 200
HARMONICS, DURATION = 20, 20.0
EVALUATIONS = 16000


def worst(design: Design, motion: FourierTrajectory) -> float:
    """Largest predicted deviation of a wanted gain."""
    return float(design.deviations(design.rows(motion)).total[design.problem.joints].max())


def best_random(design: Design, series: Series, at: np.ndarray, seed: int) -> float:
    """Of random motions, each as large as its limits allow, those that keep them all."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(RANDOM):
        motion = series.motion(series.drawn(at[k % len(at)], rng))
        try:
            found.append(worst(design, design.fitted(motion)))
        except TrajectoryError:
            continue
    return min(found, default=float("nan"))


def row(scenario: str, evaluations: int) -> str:
    """Of one scenario."""
    problem = design_problem(cell(load_scenario(scenario)))
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=HARMONICS, duration=DURATION)
    at = starts(design, problem.plant.robot.home, np.random.default_rng(0))
    random = best_random(design, series, at, 1)
    began = time.perf_counter()
    with local_processes(usable_cores()) as workers:
        pool = workers.open()
        judge: Judge = judge_in(pool, usable_cores(), problem, series)
        *_, found = search(random_point(series, at, 0, judge), STEP, 0, evaluations, judge)
        workers.close(pool)
    seconds = time.perf_counter() - began
    searched = worst(design, design.fitted(series.motion(found.x)))
    gained = 100.0 * (1.0 - searched / random)
    return (
        f"| {problem.plant.robot.name} | `{scenario}` | {100.0 * random:.3f} | {100.0 * searched:.3f} | {gained:.0f} | "
        f"{found.tried} | {seconds:.0f} |"
    )


def main() -> None:
    evaluations = int(sys.argv[1]) if len(sys.argv) > 1 else EVALUATIONS
    print("| robot | scenario | best of 200 random [%] | searched [%] | smaller by [%] | motions tried | time [s] |")
    print("|---|---|---|---|---|---|---|")
    for scenario in SCENARIOS:
        print(row(scenario, evaluations), flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
