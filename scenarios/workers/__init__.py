"""Where trials run, and what happens when a place to run them dies. A new kind is a module here and a line below."""

from scenarios.workers.dask import DASK
from scenarios.workers.kinds import WorkerKind
from scenarios.workers.processes import PROCESSES

WORKERS: dict[str, WorkerKind] = {"processes": PROCESSES, "dask": DASK}
"""All kinds; the first is meant where no option asks for another."""
