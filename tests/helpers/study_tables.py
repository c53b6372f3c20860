"""Rows of studies, as statistics need them."""

import numpy as np
import pandas as pd


def normal_rows(n: int, *, std: float = 0.01, tolerance: float = 0.02) -> pd.DataFrame:
    """Rows of a study with normal errors, claimed as 1 %, of joint 1 with a gain of 2; joint 2 is never identified."""
    error = np.random.default_rng(3).normal(0.0, std, n)
    one = {"true": 2.0, "std": 0.02, "rel_error": error, "z": error / 0.01}
    first = pd.DataFrame(
        {"trial": np.arange(n), "seed": np.arange(n), "joint": 1, **one, "identifiable": True, "failure": None}
    )
    first["passed"] = np.abs(error) <= tolerance
    second = first.assign(joint=2, std=np.nan, rel_error=np.nan, z=np.nan, identifiable=False, passed=True)
    return pd.concat([first, second]).assign(tolerance=tolerance)
