"""Workers of a Dask cluster."""

import argparse
import asyncio
import json
import logging
import time
from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ident.support.extras import needed_extra
from scenarios.experiments.workers.kinds import SCHEDULER_GONE, WorkerKind, Workers
from scenarios.support.errors import StudyError

if TYPE_CHECKING:
    from distributed import Client

FEWEST = 16
"""Least number of workers for which tasks are submitted: an adaptive cluster grows only with waiting tasks."""
ASKED_EVERY = 1.0
"""Largest age of the cached number of workers [s]."""
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
    _silence()
    if address.endswith(".json") and not Path(address).is_file():
        raise StudyError(f"{address}: no such scheduler file; start `dask scheduler --scheduler-file {address}` first")
    try:
        found = _address_in(address) if address.endswith(".json") else address
        LoopRunner().run_sync(_greet, found)
        client = Client(found, timeout=PATIENCE)
    except TimeoutError as error:
        raise StudyError(f"no Dask scheduler answers at {address} within {PATIENCE:g} s") from error
    except (OSError, ValueError, TypeError, ImportError) as error:  # the last two: no certificate, no such transport
        raise StudyError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        yield Workers(
            open=lambda: client.get_executor(pure=False),  # a repeated task must be run again
            count=lambda: _cores(client, int(time.monotonic() / ASKED_EVERY)),
            died=KilledWorker,
            reachable=lambda: client.status in ("running", "connecting"),
            close=lambda executor: executor.shutdown(wait=False),  # `shutdown` of Dask always cancels
        )


def _address_in(file: str) -> str:
    """Return the address in a scheduler file; wait while the scheduler writes it."""
    deadline = time.monotonic() + WRITTEN_WITHIN
    while True:
        try:
            return str(json.loads(Path(file).read_bytes())["address"])
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


@lru_cache(maxsize=1)
def _cores(client: "Client", moment: int) -> int:
    """Return the number of cores of a cluster, at least `FEWEST`; cached, as each query needs a round trip."""
    try:
        return max(FEWEST, sum(client.ncores().values()))
    except OSError as error:
        raise StudyError(SCHEDULER_GONE) from error


def _silence() -> None:
    """Suppress Dask's tracebacks about a lost connection, which is reported here in one line."""
    for name in (*LOGGERS, *logging.root.manager.loggerDict):  # each logger of Dask has its own level
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
