"""File of answers to problem folders with unknown true gains."""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ident.support.naming import one_line
from scenarios.benchmark.methods.answer import AnswerGain
from scenarios.benchmark.methods.call import Call, Limits, call
from scenarios.benchmark.methods.method import Method
from scenarios.experiments.judge import Claim
from scenarios.rendering.result import ResultModel
from scenarios.results.problem_folder import read_problem
from scenarios.support.errors import ScenarioError
from scenarios.support.progress import SILENT, Progress, counted

ANSWERS = "answers.json"
Model = TypeVar("Model", bound=BaseModel)


class AnswerRow(BaseModel):
    """One call: gains, one per joint, or the kind of failure with its reason."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    problem: str = Field(description="Name of the problem's folder")
    digest: str = Field(description="SHA-256 of the names and contents of the problem's files")
    method: str = Field(description="The method as given to --method")
    files: dict[str, str] = Field(
        description="Digest of each known file of the method, and version of each package that it imports"
    )
    seconds: float = Field(description="Wall time of the call [s]")
    failure: str | None = Field(None, description="Kind of the failure, null if there are gains")
    reason: str | None = Field(None, description="Description of the failure")
    gains: list[AnswerGain] = Field([], description="One entry per joint, in order; empty if the call failed")

    @property
    def claims(self) -> tuple[Claim, ...]:
        """Answers, one per joint; empty for a failed call."""
        return tuple(Claim(gain.estimate, gain.std, gain.reason) for gain in self.gains)


class AnswersFile(BaseModel):
    """Answers of any number of methods to any number of problems."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    format: Literal[1] = 1
    answers: list[AnswerRow] = []


class Answers(ResultModel):
    """What `rx90 compare --json` prints for problem folders."""

    answers: list[AnswerRow] = Field(description="One entry per problem and method")


def answered(
    folders: Sequence[Path], methods: Sequence[Method], limits: Limits, path: Path, *, stages: Progress = SILENT
) -> tuple[AnswerRow, ...]:
    """Run every method on every problem, and save each answer immediately.

    Answers in the file `path` are reused.

    Returns:
        All answers of the file.

    Raises:
        ScenarioError: If two folders have the same name.
        ForeignProblem: If a folder has no readable problem.
        ScenarioError: If the file is not a file of answers.
    """
    names = [folder.name for folder in folders]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"two problem folders are called {twice}; rename one, answers are stored under that name")
    joints = {folder: read_problem(folder).arm.n for folder in folders}
    rows = list(read_answers(path)) if path.exists() else []
    stages.begin("asking", len(folders) * len(methods))
    for folder in folders:
        digest = problem_digest(folder)
        for method in counted(methods, stages):
            wanted = folder.name, digest, method.text, dict(method.digests)
            if any((row.problem, row.digest, row.method, row.files) == wanted for row in rows):
                continue
            rows = [row for row in rows if (row.problem, row.method) != (folder.name, method.text)]
            rows.append(_answer_row(folder, digest, method, call(method, folder, joints[folder], limits)))
            write_model(AnswersFile(answers=rows), path)
    return tuple(rows)


def problem_digest(folder: Path) -> str:
    """Return the SHA-256 of the names and contents of a problem's files."""
    whole = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        whole.update(f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return whole.hexdigest()


def _answer_row(folder: Path, digest: str, method: Method, called: Call) -> AnswerRow:
    """Return a call of a method on a problem as a row."""
    claims, failure = (called.outcome, None) if isinstance(called.outcome, tuple) else ((), called.outcome)
    return AnswerRow(
        problem=folder.name,
        digest=digest,
        method=method.text,
        files=dict(method.digests),
        seconds=called.seconds,
        failure=None if failure is None else type(failure).__name__,
        reason=None if failure is None else str(failure),
        gains=[
            AnswerGain(
                joint=joint,
                estimate=claim.value,
                std=claim.std,
                identifiable=claim.value is not None,
                reason=claim.reason,
            )
            for joint, claim in enumerate(claims, 1)
        ],
    )


def read_answers(path: Path) -> tuple[AnswerRow, ...]:
    """Read a file of answers.

    Raises:
        ScenarioError: If it is not one.
    """
    return tuple(read_model(AnswersFile, path, "a file of answers").answers)


def read_model(kind: type[Model], path: Path, what: str, *, digest: str | None = None) -> Model:
    """Read and validate a JSON file. `what` names the file in messages.

    Raises:
        ScenarioError: If it cannot be read, or its digest or form is wrong.
    """
    try:
        content = path.read_bytes()
        if digest is not None and hashlib.sha256(content).hexdigest() != digest:
            raise ScenarioError(f"{one_line(path)}: its SHA-256 differs from the sealed one; give the unchanged file")
        return kind.model_validate_json(content, strict=True)
    except OSError as error:
        raise ScenarioError(f"{one_line(path)}: {error.strerror}; expected {what}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = "".join(f"{part}: " for part in first["loc"])
        raise ScenarioError(f"{one_line(path)}: not {what}: {one_line(where + first['msg'])}") from error


def write_model(model: BaseModel, path: Path) -> str:
    """Write a JSON file atomically; return its SHA-256.

    Raises:
        OSError: If it cannot be written.
    """
    content = (json.dumps(model.model_dump(mode="json"), indent=2) + "\n").encode()
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_bytes(content)
    unfinished.replace(path)
    return hashlib.sha256(content).hexdigest()
