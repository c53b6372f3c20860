"""A Monte Carlo study on a Dask cluster: two workers on this machine, for want of a larger one."""

import pandas as pd
from distributed import LocalCluster

from scenarios.cli import main


def study() -> None:
    """Twelve trials, then what they say; the same command again goes on where it was stopped."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        status = main(["monte-carlo", "quick.toml", "-n", "12", "--out", "study", "--dask", address])
    rows = pd.read_parquet("study/trials")
    print(rows.groupby("joint")["rel_error"].agg(["count", "mean", "std"]))
    raise SystemExit(status)


if __name__ == "__main__":  # workers import this file
    study()
