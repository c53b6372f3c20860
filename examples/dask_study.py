"""A Monte Carlo study on a Dask cluster: two workers on this machine, for want of a larger one."""

from distributed import LocalCluster

import scenarios


def study() -> None:
    """Twelve trials, and what they say."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        workers = scenarios.dask_workers(cluster.scheduler_address)
        rows = scenarios.load("quick.toml").monte_carlo(12, workers=workers).to_frame()
    print(rows.groupby("joint")["rel_error"].agg(["count", "mean", "std"]))


if __name__ == "__main__":  # workers import this file
    study()
