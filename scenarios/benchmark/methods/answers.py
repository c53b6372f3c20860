"""Answers to problem folders as one file: what each method claimed of each problem, by the problem's digest."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from ident.support.naming import one_line
from scenarios.benchmark.methods.answer import AnswerGain
from scenarios.benchmark.methods.call import Call
from scenarios.benchmark.methods.method import Method
from scenarios.experiments.judge import Claim
from scenarios.support.errors import ScenarioError
from scenarios.support.result_model import ResultModel

ANSWERS = "answers.json"


class AnswerRow(BaseModel):
    """One call: gains, one a joint, or the kind of failure with its reason.

    Attributes:
        problem: Name of its folder.
        digest: SHA-256 of the names and contents of the problem's files.
        method: As it was given.
        files: Digest of each file of the method's own that is known, and version of each package that it imports.
        seconds: Wall time of the call [s].
        failure: Kind of what went wrong, null if there are gains.
        reason: What went wrong, in words.
        gains: One a joint, in their order; none of a call that failed.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    problem: str
    digest: str
    method: str
    files: dict[str, str]
    seconds: float
    failure: str | None = None
    reason: str | None = None
    gains: list[AnswerGain] = []

    @property
    def claims(self) -> tuple[Claim, ...]:
        """What is claimed, one a joint; nothing of a call that failed."""
        return tuple(Claim(gain.estimate, gain.std, gain.reason) for gain in self.gains)


class AnswersFile(BaseModel):
    """Answers of any number of methods to any number of problems."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    format: Literal[1] = 1
    answers: list[AnswerRow] = []


class Answers(ResultModel):
    """What `rx90 compare --json` prints of problem folders.

    Attributes:
        answers: One a problem and method.
    """

    answers: list[AnswerRow]


def problem_digest(folder: Path) -> str:
    """SHA-256 of the names and contents of a problem's files."""
    whole = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        whole.update(f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return whole.hexdigest()


def answer_row(folder: Path, method: Method, called: Call) -> AnswerRow:
    """A call of a method on a problem as a row."""
    common = AnswerRow(
        problem=folder.name,
        digest=problem_digest(folder),
        method=method.text,
        files=dict(method.digests),
        seconds=called.seconds,
    )
    if not isinstance(called.outcome, tuple):
        error = called.outcome
        return common.model_copy(update={"failure": type(error).__name__, "reason": str(error)})
    gains = [
        AnswerGain(
            joint=joint,
            estimate=claim.value,
            std=claim.std,
            identifiable=claim.value is not None,
            reason=claim.reason,
        )
        for joint, claim in enumerate(called.outcome, 1)
    ]
    return common.model_copy(update={"gains": gains})


def read_answers(path: Path) -> tuple[AnswerRow, ...]:
    """Read a file of answers.

    Raises:
        ScenarioError: If it is none.
    """
    try:
        return tuple(AnswersFile.model_validate_json(path.read_text(encoding="utf-8"), strict=True).answers)
    except OSError as error:
        raise ScenarioError(f"{one_line(path)}: {error.strerror}") from error
    except (UnicodeDecodeError, ValidationError) as error:
        first = str(error).splitlines()[:3]
        raise ScenarioError(f"{one_line(path)}: not a file of answers: {one_line(' '.join(first))}") from error


def write_answers(rows: Sequence[AnswerRow], path: Path) -> None:
    """Write a file of answers, whole or not at all.

    Raises:
        OSError: If it cannot be written.
    """
    file = AnswersFile(answers=list(rows))
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_text(json.dumps(file.model_dump(mode="json"), indent=2) + "\n", encoding="utf-8")
    unfinished.replace(path)
