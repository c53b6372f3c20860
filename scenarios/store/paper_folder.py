"""The repeated experiment as files and as one JSON object."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import pandas as pd
from pydantic import BaseModel, ConfigDict, JsonValue, ValidationError

import scenarios.paper.published as published
from ident.arrays import Array
from ident.naming import one_line
from ident.payload_parameters import PayloadEstimate
from scenarios.errors import ForeignResult
from scenarios.paper.experiment import PaperRun
from scenarios.store.documents import to_json
from scenarios.versions import versions

FILES = ("parameters.parquet", "rows.parquet", "paper.json")


class SavedPaper(BaseModel):
    """`paper.json`: the result of `rx90 paper`, and what it takes to do it again."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    format: Literal[1] = 1
    seed: int
    command: str
    versions: dict[str, str]
    result: dict[str, JsonValue]


def read_paper(folder: Path) -> SavedPaper:
    """Read the result of `rx90 paper --out`.

    Raises:
        ForeignResult: If it is none, or one of another version.
    """
    path = folder / FILES[2]
    try:
        return SavedPaper.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ForeignResult(f"{one_line(path)}: is damaged, or of another version of rx90: {first}") from error


def write_raw_numbers(run: PaperRun, folder: Path, *, command: str) -> None:
    """Write `FILES`.

    Args:
        run: The experiment.
        folder: Where.
        command: That repeated it.

    Raises:
        OSError: If they cannot be written.
    """
    parameters = [
        {"case": name, **asdict(p), "total_std": p.total_std, "essential": p.essential}
        for name, case in _cases(run)
        for p in case.parameters
    ]
    pd.DataFrame(parameters).to_parquet(folder / FILES[0], index=False)
    pd.concat([_rows(name, case) for name, case in _cases(run)]).to_parquet(folder / FILES[1], index=False)
    saved = {
        "format": 1,
        "seed": run.seed,
        "command": command,
        "versions": versions(),
        "result": paper_document(run),
    }
    (folder / FILES[2]).write_text(to_json(saved) + "\n", encoding="utf-8")


def _cases(run: PaperRun) -> Iterator[tuple[str, PayloadEstimate]]:
    yield from ((f"case {k}", case) for k, case in enumerate(run.cases, 1))
    yield "second payload", run.second


def paper_document(run: PaperRun) -> dict[str, object]:
    """The result of `rx90 paper` as one JSON object."""
    cases = [
        {
            "case": k,
            **_estimate(case, run.payloads[0]),
            "published": {**asdict(printed), "gains": list(published.GAINS) if k == 2 else None},
        }
        for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1)
    ]
    second = {
        **_estimate(run.second, run.payloads[1]),
        "published": {"M": published.SECOND_MASS, "M_2sigma": published.SECOND_MASS_2SIGMA},
    }
    checks = [asdict(check) for check in run.checks]
    return {"cases": cases, "second_payload": second, "checks": checks, "passed": run.passed}


def _estimate(case: PayloadEstimate, true: Array) -> dict[str, object]:
    payload = [
        {
            "parameter": p.name,
            "true": float(value),
            "estimate": p.value,
            "std": p.total_std,
            "tolerance": None,
            "passed": None,
            "known": p.known,
            "essential": p.essential,
        }
        for p, value in zip(case.parameters, true, strict=True)
    ]
    fit = {
        "method": case.method,
        "rows": len(case.system.V),
        "error_norm": case.error_norm,
        "rel_error_norm": case.rel_error_norm,
        "sigma": case.sigma,
    }
    return {"gains": case.gain.tolist(), "payload": payload, "fit": fit}


def _rows(name: str, case: PayloadEstimate) -> pd.DataFrame:
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
