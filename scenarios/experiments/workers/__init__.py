"""Workers that run trials, and handling of their failures. A new kind needs a module here and an entry below."""

import argparse
from contextlib import AbstractContextManager

from scenarios.experiments.workers.dask import DASK
from scenarios.experiments.workers.execute import WorkerKind, Workers
from scenarios.experiments.workers.processes import PROCESSES

WORKERS: dict[str, WorkerKind] = {"processes": PROCESSES, "dask": DASK}
"""All kinds; the first is the default."""


def add_worker_options(parser: argparse.ArgumentParser) -> None:
    """Add one option per kind of workers; at most one may be used."""
    group = parser.add_mutually_exclusive_group()
    for kind in WORKERS.values():
        group.add_argument(
            f"--{kind.option}", dest=kind.option, type=kind.checked, metavar=kind.metavar, help=kind.help
        )


def open_workers(options: argparse.Namespace) -> AbstractContextManager[Workers]:
    """Return the workers of parsed options."""
    kind, value = _chosen(options)
    return kind.open(value)


def worker_words(options: argparse.Namespace) -> list[str]:
    """Return the command-line arguments that select the same workers."""
    kind, value = _chosen(options)
    return [] if value is None else [f"--{kind.option}", value]


def _chosen(options: argparse.Namespace) -> tuple[WorkerKind, str | None]:
    values = {name: getattr(options, kind.option) for name, kind in WORKERS.items()}
    name = next((name for name, value in values.items() if value is not None), next(iter(WORKERS)))
    return WORKERS[name], values[name]
