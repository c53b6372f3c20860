"""Writes diagnosis.md: what is said of sound logs, and of the same logs with faults put into them one at a time.

Runs are kept in `out/diagnosis/outcomes.jsonl`, a line each: the same command goes on from there. Their order is
shuffled, so that an end by `--seconds` leaves a fair sample; sound and faulty logs take turns.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from diagnosis_cases import AS_IT_IS, MUJOCO, PINOCCHIO, REAL, SoundCase, Spec, loaded, real_cases, simulated_specs
from diagnosis_faults import FaultyCase, chosen, faults_of
from diagnosis_judged import judged
from diagnosis_page import Faulty, Sound, page
from diagnosis_run import Run, as_row, from_row, run_faulty, run_sound
from threadpoolctl import threadpool_limits

from scenarios.reports.files import write_markdown

OUT = Path("out/diagnosis/outcomes.jsonl")
FAULTY = {MUJOCO: (AS_IT_IS, "mass only"), PINOCCHIO: ("mild", "targets"), REAL: ("bare ur10e, loaded ur10e", "bare")}
"""Conditions that faults are put into, of each source."""
FIRST_SEED = 300


@dataclass(frozen=True, slots=True)
class Job:
    """One set of logs to be doubted.

    Attributes:
        spec: Of the sound case.
        fault: Its name within the case, None for none.
    """

    spec: Spec
    fault: tuple[str, str] | None

    @property
    def name(self) -> str:
        """Unique."""
        return self.spec.name if self.fault is None else f"{self.spec.name}; {self.fault[0]}, {self.fault[1]}"


class Kept:
    """Runs in a file, a line each."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self.runs = {run.name: run for run in (from_row(json.loads(line)) for line in lines)}

    def of(self, name: str, make: Callable[[], Run]) -> Run:
        """A run that is kept, or made now."""
        if name not in self.runs:
            self.runs[name] = make()
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(as_row(self.runs[name])) + "\n")
        return self.runs[name]


def specs(arms: Sequence[str]) -> list[Spec]:
    """Of all sound cases of some arms, of all arms if none is named."""
    found = simulated_specs() + [each.spec for each in real_cases()]
    return [each for each in found if not arms or each.arm in arms]


@lru_cache(maxsize=4)
def case_of(spec: Spec) -> SoundCase | None:
    """The case, None where the robot cannot carry it out."""
    if spec.source == REAL:
        return next(real_cases(lambda each: each == spec))
    return loaded(spec)


def fault_jobs(spec: Spec, sample: int) -> Iterator[Job]:
    """Faults to be put into one case."""
    case = case_of(spec)
    if case is not None:
        yield from (Job(spec, (each.kind, each.words)) for each in chosen(faults_of(case), case.name, sample))


def jobs(arms: Sequence[str], sample: int) -> list[Job]:
    """All of them, sound and faulty ones by turns, each kind in an order of its own."""
    every = specs(arms)
    bearing = [each for each in every if each.condition in FAULTY[each.source] and each.seed in (0, FIRST_SEED)]
    kinds = ([Job(each, None) for each in every], [job for each in bearing for job in fault_jobs(each, sample)])
    rng = np.random.default_rng(1903)
    placed: list[tuple[float, Job]] = []
    for kind in kinds:
        order = rng.permutation(len(kind)).tolist()
        placed += [((k + 0.5) / len(kind), kind[i]) for k, i in enumerate(order)]
    return [job for _, job in sorted(placed, key=lambda each: each[0])]


def do(job: Job, kept: Kept) -> Run | None:
    """Doubt the logs of a job; a fault needs its case without it."""
    if job.name in kept.runs:
        return kept.runs[job.name]
    case = case_of(job.spec)
    if case is None:
        return None
    sound = kept.of(case.name, lambda: run_sound(case))
    if job.fault is None:
        return sound
    fault = next(each for each in faults_of(case) if (each.kind, each.words) == job.fault)
    motions, structure = fault.apply(case.motions, case.structure)
    return kept.of(job.name, lambda: run_faulty(FaultyCase(case, fault, motions, structure)))


def done(todo: Sequence[Job], kept: Kept) -> tuple[list[Sound], list[Faulty]]:
    """What there is of all jobs."""
    sound: list[Sound] = []
    faulty: list[Faulty] = []
    for job in sorted((job for job in todo if job.name in kept.runs), key=lambda job: job.name):
        case, found = case_of(job.spec), kept.runs[job.name]
        assert case is not None, "it was run"
        if job.fault is None:
            sound.append(Sound(case, found))
            continue
        fault = next(each for each in faults_of(case) if (each.kind, each.words) == job.fault)
        faulty.append(Faulty(case, fault, found, judged(case, fault, found, kept.runs[job.spec.name])))
    return sound, faulty


def main() -> None:
    """Run what is not there yet, and write the page of what there is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", nargs="*", default=(), help="arms by name; all if none")
    parser.add_argument("--sample", type=int, default=30, help="faults of each case that bears them")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="end early, with what there is")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    until = time.monotonic() + options.seconds
    kept = Kept(options.out)
    todo = jobs(options.arms, options.sample)
    with threadpool_limits(1):
        for job in todo:
            if time.monotonic() > until:
                break
            found = do(job, kept)
            if found is not None:
                print(f"{job.name}: {found.error or ', '.join(each.name for each in found.said) or '-'}", flush=True)
        write_markdown(page(*done(todo, kept)), Path(__file__).parent / "diagnosis.md")


if __name__ == "__main__":
    main()
