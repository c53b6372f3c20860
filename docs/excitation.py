"""Writes excitation.md: what a search finds, beside random motions and the scenario's own, on every built-in robot."""

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from opening import write_page
from threadpoolctl import threadpool_limits

from scenarios.design.excitation import Design, design_problem
from scenarios.design.search import (
    SMALL_SIZES,
    STEP,
    Found,
    Judge,
    Series,
    best_fitted,
    judge_here,
    random_point,
    search,
    starts,
    with_better,
)
from scenarios.experiments.build import setup_of, setup_without_motion
from scenarios.experiments.files.loading import load_scenario
from sim.errors import TrajectoryError

HOME = Path(__file__).parent
OUT = Path("out") / "excitation"
SCENARIOS = ("nominal", "mass-only", "ur10e", "tx40", "panda", "stanford")
RANDOM = 200
HARMONICS, DURATION = 20, 20.0
EVALUATIONS = 6000
HEAD = f"""# Accuracy with searched motions

Written by `make excitation`; no number is typed by hand. Predicted standard deviation of the gain of the worst wanted
joint [%], by the method of the scenario and with what it knows of its payload (all of it, in `mass-only` its mass).

**Random**: the best of {RANDOM} random motions, each as large as range, speed and acceleration of its joints allow,
then reduced until torques and distances are within limits too; the next column counts the motions for which this is
possible. **Own**: the motion of the scenario, from a longer search or one for another scenario. **Searched**: the
result of `rx90 excite` with --evaluations {EVALUATIONS}, seed 0, without the scenario's own motion. Random and
searched motions last {DURATION:g} s and have {HARMONICS} harmonics. **Time** is the processor time of the search, on
one core; two minutes on two cores are 240 s.

| Robot | Scenario | Random | of them fitted | Own | Searched | Below random by | Motions tried | Time [s] |
|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Row:
    """Of one scenario; deviations are those of the worst wanted joint, relative.

    Attributes:
        robot: Its name.
        scenario: Its name.
        random: Best of the random motions, None if none could be fitted.
        fitted: Random motions that could be.
        own: Of the scenario's motion.
        searched: Of the motion found.
        tried: Motions that the search tried.
        seconds: Processor time of the search.
    """

    robot: str
    scenario: str
    random: float | None
    fitted: int
    own: float
    searched: float
    tried: int
    seconds: float

    @property
    def text(self) -> str:
        """As a line of the table."""
        random = "none" if self.random is None else f"{100.0 * self.random:.3f}"
        below = "" if self.random is None else f"{100.0 * (1.0 - self.searched / self.random):.0f} %"
        return (
            f"| {self.robot} | `{self.scenario}` | {random} | {self.fitted} | {100.0 * self.own:.3f} | "
            f"{100.0 * self.searched:.3f} | {below} | {self.tried} | {self.seconds:.0f} |"
        )


def random_motions(design: Design, series: Series, at: np.ndarray, seed: int) -> list[float]:
    """Deviations of the random motions that can be fitted."""
    rng = np.random.default_rng(seed)
    found = list[float]()
    for k in range(RANDOM):
        motion = series.motion(series.drawn(at[k % len(at)], rng))
        try:
            found.append(design.worst(design.fitted(motion, np.append(1.0, SMALL_SIZES))))
        except TrajectoryError:
            continue
    return found


def row(name: str) -> Row:
    """Of one scenario."""
    scenario = load_scenario(name)
    problem = design_problem(setup_without_motion(scenario))
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=HARMONICS, duration=DURATION)
    at = starts(design, problem.plant.robot.home, np.random.default_rng(0))
    random = random_motions(design, series, at, 1)
    judge: Judge = judge_here(design, series)
    kept, tried = tuple[Found, ...](), 0
    began = time.process_time()
    for found in search(random_point(series, at, 0, judge), STEP, 0, EVALUATIONS, judge):
        kept, tried = with_better(kept, found), found.tried
    motion, _ = best_fitted(design, series, kept)
    return Row(
        robot=problem.plant.robot.name,
        scenario=name,
        random=min(random, default=None),
        fitted=len(random),
        own=design.worst(setup_of(scenario).experiments[0].trajectory),
        searched=design.worst(motion),
        tried=tried,
        seconds=time.process_time() - began,
    )


def kept_row(name: str) -> Row:
    """Of one scenario, from what an earlier run has left if there is any."""
    path = OUT / f"{name}.json"
    if not path.is_file():
        OUT.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(row(name)), indent=1), encoding="utf-8")
    return Row(**json.loads(path.read_text(encoding="utf-8")))


def page(rows: Sequence[Row]) -> str:
    """The page."""
    return HEAD + "\n".join(each.text for each in rows) + "\n"


def main() -> None:
    """Measure what is not measured yet, one scenario after another, and write the page."""
    rows = []
    for name in SCENARIOS:
        rows.append(kept_row(name))
        print(rows[-1].text, flush=True)
    write_page(HOME / "excitation.md", page(rows))


if __name__ == "__main__":
    with threadpool_limits(1):
        main()
