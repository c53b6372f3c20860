"""Workers of a Dask cluster, through `distributed`'s executor."""

import argparse
import asyncio
import json
import logging
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ident.support.naming import needed_extra
from scenarios.experiments.workers.execute import SCHEDULER_GONE, WorkerKind, Workers
from scenarios.support.errors import StudyError

FEWEST = 16
"""Least number of workers for which tasks are submitted: an adaptive cluster grows only with waiting tasks."""
LOGGERS = ("distributed", "tornado", "asyncio")
"""Loggers that report a dying scheduler."""
PATIENCE = 10.0
"""Timeout for connecting to a scheduler [s]."""
WRITTEN_WITHIN = 1.0
"""Timeout for a scheduler to write its file [s]."""


@contextmanager
def dask_workers(address: str) -> Generator[Workers]:
    """Workers of a Dask cluster.

    Args:
        address: Address of its scheduler, as `tcp://host:8786`, or path of its scheduler file.

    Raises:
        StudyError: If Dask is not installed; if no scheduler answers.
    """
    try:
        from distributed import Client, KilledWorker
        from distributed.utils import LoopRunner
    except ImportError as error:
        raise StudyError(str(needed_extra("distributed"))) from error
    for name in (*LOGGERS, *logging.root.manager.loggerDict):  # each logger of Dask has its own level
        if name.partition(".")[0] in LOGGERS:  # a lost connection is reported here in one line
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    found = _address_in(Path(address)) if address.endswith(".json") else address
    try:
        LoopRunner().run_sync(_greet, found)
        client = Client(found, timeout=PATIENCE)
    except TimeoutError as error:
        raise StudyError(f"no Dask scheduler answers at {address} within {PATIENCE:g} s") from error
    except (OSError, ValueError, TypeError, ImportError) as error:  # the last two: no certificate, no such transport
        raise StudyError(f"no Dask scheduler answers at {address}: {error}") from error

    def count() -> int:
        if client.status not in ("running", "connecting"):
            raise StudyError(SCHEDULER_GONE)
        try:
            return max(FEWEST, sum(client.ncores().values()))
        except OSError as error:
            raise StudyError(SCHEDULER_GONE) from error

    with client:
        yield Workers(
            open=lambda: client.get_executor(pure=False),  # a repeated task must be run again
            count=count,
            died=KilledWorker,
            close=lambda executor: executor.shutdown(wait=False),  # which cancels
        )


def _address_in(file: Path) -> str:
    """Return the address in a scheduler file; wait while the scheduler writes it."""
    if not file.is_file():
        raise StudyError(f"{file}: no such scheduler file; start `dask scheduler --scheduler-file {file}` first")
    deadline = time.monotonic() + WRITTEN_WITHIN
    while True:
        try:
            return str(json.loads(file.read_bytes())["address"])
        except (ValueError, KeyError, TypeError) as error:
            if time.monotonic() > deadline:
                raise StudyError(
                    f"{file}: not a scheduler file: it states no address; write one with `dask scheduler "
                    "--scheduler-file FILE`"
                ) from error
        time.sleep(0.01)


async def _greet(address: str) -> None:
    """Test the connection: a client would wait for the first answer without a timeout."""
    from distributed.comm.core import connect
    from distributed.security import Security

    security: dict[str, Any] = Security().get_connection_args("client")
    comm = await asyncio.wait_for(connect(address, timeout=PATIENCE, **security), PATIENCE)
    await comm.close()


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
)
