"""Sealed problems: published without true gains but with their digest, and scored after their publication.

A folder of sealed problems has `problems/` and `seal.json` with the digests, both for publication, and `truth/`, to be
kept secret until the answers have arrived. A random salt in each file prevents testing guesses against the digest.
"""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field

from ident.support.arrays import Array
from scenarios.benchmark.comparison.bound import gain_bound
from scenarios.benchmark.comparison.statistics import NEEDED
from scenarios.benchmark.comparison.study import METHOD, write_trial
from scenarios.benchmark.methods.answers import AnswerRow, problem_digest, read_model, write_model
from scenarios.experiments.judge import Claim
from scenarios.experiments.run import simulate
from scenarios.experiments.schema import Scenario
from scenarios.experiments.setup import Setup, setup_of
from scenarios.rendering.result import ResultModel
from scenarios.support.errors import ScenarioError
from scenarios.support.progress import SILENT, Progress, counted
from scenarios.support.seeds import SEEDS

PROBLEMS, TRUTH, SEAL = "problems", "truth", "seal.json"
SALT_BYTES = 32


class TruthFile(BaseModel):
    """The true gains of one problem, with a random salt.

    `bound` is the smallest relative standard deviation of each gain in its scenario, from `gain_bound`: null for a
    joint that is not identifiable, and null altogether without injected noise; it may be missing.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    salt: str
    scenario: str
    seed: int
    gain: tuple[float, ...]
    identifiable: tuple[bool, ...]
    bound: tuple[float | None, ...] | None = None


class Sealed(BaseModel):
    """Digests of one problem and of its true gains."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    problem: str
    truth: str


class SealFile(BaseModel):
    """Published SHA-256 of each problem and of its true gains, by the name of the problem."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    format: Literal[1] = 1
    problems: dict[str, Sealed]


class SealedProblems(ResultModel):
    """What `rx90 compare --seal DIR --json` prints."""

    problems: int = Field(description="Number of sealed problems")
    folder: str = Field(description="Folder of the problems, of the seal file and, until published, of the true gains")


@dataclass(frozen=True, slots=True)
class Revealed:
    """True gains that match the published digests, and digests of the problems, by name."""

    truths: Mapping[str, TruthFile]
    digests: Mapping[str, str]

    def bound(self, scenario: str) -> Array | None:
        """Return the smallest relative standard deviation of each gain, shape (n,); None if not stated, or not unique.

        Infinite for a joint that is not identifiable.
        """
        stated = {truth.bound for truth in self.truths.values() if truth.scenario == scenario}
        (one, *others) = stated
        if others or one is None:
            return None
        return np.array([np.inf if value is None else value for value in one])


def unknown_seed(count: int) -> int:
    """Return a random first seed for a number of trials."""
    return secrets.randbelow(SEEDS - count)


def seal(
    scenarios: Sequence[Scenario], count: int, seed: int, folder: Path, *, stages: Progress = SILENT
) -> SealedProblems:
    """Write problems, digests and true gains.

    Args:
        scenarios: Scenarios whose trials become problems, in random order.
        count: Number of trials of each.
        seed: Seed of the first trial of each.
        folder: A new or empty folder.
        stages: Display of the progress.

    Raises:
        SimulationError: If a trial cannot be carried out.
        OSError: If something cannot be written.
    """
    setups = [setup_of(scenario) for scenario in scenarios]
    bounds = [_bound(setup) for setup in setups]
    trials = [(setup, bound, seed + k) for setup, bound in zip(setups, bounds, strict=True) for k in range(count)]
    order = secrets.SystemRandom().sample(range(len(trials)), len(trials))
    (folder / TRUTH).mkdir(parents=True)
    sealed: dict[str, Sealed] = {}
    stages.begin("simulating", len(order))
    for number, place in enumerate(counted(order, stages), 1):
        name = f"problem-{number:04d}"
        setup, bound, own = trials[place]
        simulated = simulate(setup, own, threads=1)
        write_trial(simulated, folder / PROBLEMS / name)
        truth = TruthFile(
            salt=secrets.token_hex(SALT_BYTES),
            scenario=setup.scenario.name,
            seed=own,
            gain=tuple(simulated.truth.gain.tolist()),
            identifiable=simulated.setup.scenario.table.tolerance.identifiable,
            bound=bound,
        )
        digest = write_model(truth, folder / TRUTH / f"{name}.json")
        sealed[name] = Sealed(problem=problem_digest(folder / PROBLEMS / name), truth=digest)
    write_model(SealFile(problems=sealed), folder / SEAL)
    return SealedProblems(problems=len(sealed), folder=str(folder))


def revealed(seal_file: Path, truths: Path) -> Revealed:
    """Read the true gains and check them against the published digests.

    Raises:
        ScenarioError: If a file is missing, or differs from the sealed one.
    """
    stated = read_model(SealFile, seal_file, "the seal file of a set of problems")
    found = {
        name: read_model(TruthFile, truths / f"{name}.json", "the true gains of a problem", digest=each.truth)
        for name, each in stated.problems.items()
    }
    return Revealed(found, {name: each.problem for name, each in stated.problems.items()})


def scored(answers: Sequence[AnswerRow], known: Revealed) -> dict[str, pd.DataFrame]:
    """Return rows of a comparison, by scenario; a missing answer is a refusal of all joints.

    Raises:
        ScenarioError: If an answer is not to a sealed problem, or to other content of it, or has other joints.
    """
    by_call = {(answer.method, answer.problem): answer for answer in answers}
    for answer in answers:
        if known.digests.get(answer.problem) != answer.digest:
            raise ScenarioError(f"{answer.method}: {answer.problem}: this is not the problem that was sealed")
    rows: dict[str, list[dict[str, object]]] = {}
    for method in dict.fromkeys(answer.method for answer in answers):
        for trial, (name, truth) in enumerate(known.truths.items()):
            answer = by_call.get((method, name))
            rows.setdefault(truth.scenario, []).extend(_rows(method, trial, truth, answer))
    numbers = dict.fromkeys(("true", "estimate", "std", "rel_error", "seconds"), np.float64)
    return {name: pd.DataFrame(each, columns=list(NEEDED)).astype(numbers) for name, each in rows.items()}


def _rows(method: str, trial: int, truth: TruthFile, answer: AnswerRow | None) -> list[dict[str, object]]:
    claims = (answer.claims if answer is not None else ()) or (Claim(None, None, None),) * len(truth.gain)
    if len(claims) != len(truth.gain):
        raise ScenarioError(f"{method}: {len(claims)} gains; the sealed problem has {len(truth.gain)} joints")
    return [
        {
            METHOD: method,
            "trial": trial,
            "joint": joint,
            "true": true,
            "estimate": claim.value,
            "std": claim.std,
            "rel_error": None if claim.value is None else (claim.value - true) / true,
            "expected": expected,
            "seconds": 0.0 if answer is None else answer.seconds,
            "failure": None if answer is None else answer.failure,
        }
        for joint, (claim, true, expected) in enumerate(zip(claims, truth.gain, truth.identifiable, strict=True), 1)
    ]


def _bound(setup: Setup) -> tuple[float | None, ...] | None:
    found = gain_bound(setup)
    return None if found is None else tuple(value if np.isfinite(value) else None for value in found.tolist())
