"""The repeated experiment as files and as one JSON object."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import pandas as pd

import scenarios.paper.published as published
from ident.arrays import Array
from ident.payload_parameters import PayloadEstimate
from scenarios.paper.experiment import PaperRun

FILES = ("parameters.parquet", "rows.parquet")


def write_raw_numbers(run: PaperRun, folder: Path) -> None:
    """Write `parameters.parquet` and `rows.parquet`.

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
