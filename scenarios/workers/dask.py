"""Workers of a Dask cluster."""

import argparse
import logging
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import DaskMissing, SchedulerGone, SchedulerSilent
from scenarios.workers.kinds import WorkerKind, Workers

if TYPE_CHECKING:
    from distributed import Client

FEWEST = 16
"""Workers that tasks are handed out for at least: a cluster that adapts to its load grows only if it sees some."""
LOGGERS = ("distributed", "tornado", "asyncio")
"""Whose loggers speak of a scheduler that dies."""
PATIENCE = 10
"""How long to wait for a scheduler [s]."""


@contextmanager
def dask_workers(address: str) -> Generator[Workers]:
    """Workers of a Dask cluster.

    Args:
        address: Of its scheduler, as `tcp://host:8786`, or the path of its scheduler file.

    Raises:
        DaskMissing: If Dask is not installed.
        SchedulerSilent: If no scheduler answers.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError as error:
        raise DaskMissing("Dask is not installed; install the extra: pip install '.[cluster]'") from error
    _silence()
    if address.endswith(".json") and not Path(address).is_file():
        raise SchedulerSilent(
            f"{address}: no such scheduler file; start `dask scheduler --scheduler-file {address}` first"
        )
    try:
        if address.endswith(".json"):
            client = Client(scheduler_file=address, timeout=PATIENCE)
        else:
            client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise SchedulerSilent(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        yield Workers(
            open=lambda: client.get_executor(pure=False),  # a task tried again is no repetition with a known result
            count=lambda: _cores_of(client),
            died=KilledWorker,
            reachable=lambda: client.status in ("running", "connecting"),
            close=lambda executor: executor.shutdown(wait=False),  # it cancels, and knows no word for it
        )


def _cores_of(client: "Client") -> int:
    try:
        return max(FEWEST, sum(client.ncores().values()))
    except OSError as error:
        raise SchedulerGone() from error


def _silence() -> None:
    """What Dask and what it runs on would log of a lost connection is said in one line here, not in tracebacks."""
    for name in (*LOGGERS, *logging.root.manager.loggerDict):  # each of Dask's has a level of its own
        if name.partition(".")[0] in LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _address(text: str) -> str:
    if not text:
        raise argparse.ArgumentTypeError("expected tcp://HOST:PORT or a scheduler file")
    return text


DASK = WorkerKind(
    option="dask",
    metavar="ADDRESS",
    help="scheduler of a Dask cluster, tcp://HOST:PORT or its file",
    checked=_address,
    open=lambda value: dask_workers(value or ""),
    prepare=lambda: None,
)
