"""Rows of a comparison, made up."""

import pandas as pd

from scenarios.benchmark.comparison import NEEDED
from scenarios.benchmark.study import METHOD


def told(method: str, *rows: dict) -> pd.DataFrame:
    """Rows of trials that count up; joint 1 unless it is said."""
    common = {
        "joint": 1,
        "true": 2.0,
        "estimate": None,
        "std": None,
        "rel_error": None,
        "expected": True,
        "seconds": 0.5,
        "failure": None,
    }
    full = [{METHOD: method, "trial": k, **common, **row} for k, row in enumerate(rows)]
    for row in full:
        if row["estimate"] is not None and row["rel_error"] is None:
            row["rel_error"] = (row["estimate"] - row["true"]) / row["true"]
    frame = pd.DataFrame(full, columns=list(NEEDED))
    return frame.astype({"estimate": float, "std": float, "rel_error": float, "seconds": float})
