"""Files and JSON object of the repeated experiment."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Literal, TypedDict

import pandas as pd
from pydantic import BaseModel, ConfigDict, JsonValue, ValidationError

import scenarios.benchmark.paper.published as published
from ident.estimation.estimate import IdentifiedGain, JointResult
from ident.parameters.pooled_payload import PayloadEstimate
from ident.support.arrays import Array
from ident.support.naming import one_line
from scenarios.benchmark.paper.experiment import PaperRun
from scenarios.benchmark.paper.result import PaperCase, PaperFit, PaperGain, PaperParameter, PaperPayload, PaperResult
from scenarios.rendering.result import to_json
from scenarios.results.record import digests_of
from scenarios.support.errors import ScenarioError
from scenarios.support.versions import versions

PARAMETERS, ROWS, PAPER = "parameters.parquet", "rows.parquet", "paper.json"
FILES = (PARAMETERS, ROWS, PAPER)


class SavedPaper(BaseModel):
    """`paper.json`: the result of `rx90 paper`, provenance, and digests of the other files."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    format: Literal[1] = 1
    seed: int
    command: str
    versions: dict[str, str]
    files: dict[str, str] = {}
    result: dict[str, JsonValue]


def read_paper(folder: Path) -> tuple[SavedPaper, PaperResult]:
    """Read the result of `rx90 paper --out`, as written and as values of its tables.

    Raises:
        ScenarioError: If it is not a result, or of another version.
    """
    path = folder / PAPER
    try:
        saved = SavedPaper.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ScenarioError(f"{one_line(path)}: damaged, or written by another version of rx90: {first}") from error
    try:
        return saved, PaperResult.model_validate(saved.result)
    except ValidationError as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        again = f"write it again: {one_line(saved.command)} --force"
        raise ScenarioError(f"{one_line(path)}: its result lacks data for the page: {first}; {again}") from error


def read_torques(folder: Path, saved: SavedPaper, case: int) -> pd.DataFrame:
    """Return the rows of a case, counted from 1, as `case_rows`.

    Raises:
        ScenarioError: If their file is missing or was changed.
    """
    path = folder / ROWS
    try:
        same = digests_of(folder, [ROWS])[ROWS] == saved.files.get(ROWS)
        rows = pd.read_parquet(path) if same else None
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{one_line(path)}: cannot be read: {error}") from error
    if rows is None:
        raise ScenarioError(f"{one_line(path)}: is not the file that {PAPER} names; write it again")
    return rows.query(f"case == {_case(case)!r}")


def write_raw_numbers(run: PaperRun, folder: Path, *, command: str) -> None:
    """Write `FILES`.

    Raises:
        OSError: If they cannot be written.
    """
    parameters = [
        {
            "case": name,
            "name": p.name,
            "value": p.value,
            "std": p.residual_std,
            "gain_std": p.gain_std,
            "known": p.known,
            "total_std": p.std,
            "essential": p.essential,
        }
        for name, case in _cases(run)
        for p in case.parameters
    ]
    pd.DataFrame(parameters).to_parquet(folder / PARAMETERS, index=False)
    pd.concat([case_rows(name, case) for name, case in _cases(run)]).to_parquet(folder / ROWS, index=False)
    saved = {
        "format": 1,
        "seed": run.seed,
        "command": command,
        "versions": versions(),
        "files": digests_of(folder, [PARAMETERS, ROWS]),
        "result": paper_result(run).model_dump(mode="json"),
    }
    (folder / PAPER).write_text(to_json(saved) + "\n", encoding="utf-8")


def _cases(run: PaperRun) -> Iterator[tuple[str, PayloadEstimate]]:
    yield from ((_case(k), case) for k, case in enumerate(run.cases, 1))
    yield "second payload", run.second


def _case(number: int) -> str:
    """Return the file name of the rows of a case."""
    return f"case {number}"


def paper_result(run: PaperRun) -> PaperResult:
    """Return the result of `rx90 paper`."""
    cases = tuple(
        PaperCase(
            case=k,
            **_estimate(case, run.payloads[0]),
            published={**asdict(printed), "gains": list(published.GAINS) if k == 2 else None},
        )
        for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1)
    )
    pairs = zip(run.gains.joints, run.true_gain.tolist(), strict=True)
    return PaperResult(
        gains=tuple(_gain(joint, found, true) for joint, (found, true) in enumerate(pairs, 1)),
        cases=cases,
        patterns=run.patterns,
        second_payload=PaperPayload(
            **_estimate(run.second, run.payloads[1]),
            published={"M": published.SECOND_MASS, "M_2sigma": published.SECOND_MASS_2SIGMA},
        ),
        checks=run.checks,
        passed=run.passed,
    )


def _gain(joint: int, found: JointResult, true: float) -> PaperGain:
    known = isinstance(found, IdentifiedGain)
    return PaperGain(
        joint=joint,
        true=true,
        estimate=found.value if known else None,
        std=found.residual_std if known else None,
        identifiable=known,
        reason=None if known else found.reason,
    )


class _Estimate(TypedDict):
    gains: tuple[float, ...]
    payload: tuple[PaperParameter, ...]
    fit: PaperFit


def _estimate(case: PayloadEstimate, true: Array) -> _Estimate:
    """Return the common keys of a case and of the second payload."""
    payload = tuple(
        PaperParameter(parameter=p.name, true=value, estimate=p.value, std=p.std, known=p.known, essential=p.essential)
        for p, value in zip(case.parameters, true.tolist(), strict=True)
    )
    fit = PaperFit(
        method=case.method,
        rows=len(case.system.V),
        unknowns=case.unknowns,
        error_norm=case.error_norm,
        rel_error_norm=case.rel_error_norm,
        sigma=case.sigma,
    )
    return {"gains": tuple(case.gain.tolist()), "payload": payload, "fit": fit}


def case_rows(name: str, case: PayloadEstimate) -> pd.DataFrame:
    """Return the rows of a case, the data of figure 3.

    Columns: `case`; `joint`, from 1; `loaded`, whether the row is of the loaded motion; `t`, time in its motion [s];
    `measured`, gain in use times current [N m]; `reconstructed`, torque of the fitted model [N m].
    """
    system = case.system
    return pd.DataFrame(
        {
            "case": name,
            "joint": system.joint + 1,
            "loaded": system.loaded,
            "t": system.t,
            "measured": case.gain[system.joint] * system.V,
            "reconstructed": case.torque,
        }
    )
