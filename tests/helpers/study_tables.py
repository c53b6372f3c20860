"""Rows of studies, from tables that state only what a test is about."""

import numpy as np
import pandas as pd

from scenarios.experiments.statistics import COLUMNS


def gathered(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with all columns of statistics; those that are left out are null."""
    return rows.reindex(columns=list(COLUMNS))


def normal_rows(n: int, *, std: float = 0.01, tolerance: float = 0.02) -> pd.DataFrame:
    """Rows of a study with normal errors, claimed as 1 %, of joint 1 with a gain of 2; joint 2 is never identified."""
    error = np.random.default_rng(3).normal(0.0, std, n)
    one = {"true": 2.0, "std": 0.02, "rel_error": error, "z": error / 0.01}
    first = pd.DataFrame({"trial": np.arange(n), "joint": 1, **one, "identifiable": True, "failure": None})
    first["passed"] = np.abs(error) <= tolerance
    second = first.assign(joint=2, std=np.nan, rel_error=np.nan, z=np.nan, identifiable=False, passed=True)
    return pd.concat([first, second]).assign(tolerance=tolerance)
