"""Where trials run, and what happens when a place to run them dies. A new kind is a module here and a line below."""

from scenarios.experiments.workers.dask import DASK
from scenarios.experiments.workers.kinds import WorkerKind
from scenarios.experiments.workers.processes import PROCESSES

WORKERS: dict[str, WorkerKind] = {"processes": PROCESSES, "dask": DASK}
"""All kinds; the first is meant where no option asks for another."""
