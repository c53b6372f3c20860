"""Where trials run, and what happens when a place to run them dies. A new kind is a module here and a line below."""

import argparse
from contextlib import AbstractContextManager

from scenarios.experiments.workers.dask import DASK
from scenarios.experiments.workers.kinds import WorkerKind, Workers
from scenarios.experiments.workers.processes import PROCESSES

WORKERS: dict[str, WorkerKind] = {"processes": PROCESSES, "dask": DASK}
"""All kinds; the first is meant where no option asks for another."""


def add_worker_options(parser: argparse.ArgumentParser) -> None:
    """Add one option a kind of workers; a command line has one of them at most."""
    group = parser.add_mutually_exclusive_group()
    for kind in WORKERS.values():
        group.add_argument(
            f"--{kind.option}", dest=kind.option, type=kind.checked, metavar=kind.metavar, help=kind.help
        )


def open_workers(options: argparse.Namespace) -> AbstractContextManager[Workers]:
    """The workers that parsed options ask for."""
    kind, value = _chosen(options)
    return kind.open(value)


def worker_words(options: argparse.Namespace) -> list[str]:
    """The words of a command line that ask for the same workers again."""
    kind, value = _chosen(options)
    return [] if value is None else [f"--{kind.option}", value]


def prepare_workers(options: argparse.Namespace) -> None:
    """Start what the workers need that takes time; to be called before anything large is imported."""
    _chosen(options)[0].prepare()


def _chosen(options: argparse.Namespace) -> tuple[WorkerKind, str | None]:
    values = {name: getattr(options, kind.option) for name, kind in WORKERS.items()}
    name = next((name for name, value in values.items() if value is not None), next(iter(WORKERS)))
    return WORKERS[name], values[name]
