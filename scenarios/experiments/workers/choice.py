"""The workers that a command line asks for: its options, and the kind they choose."""

import argparse
from contextlib import AbstractContextManager

from scenarios.experiments.workers import WORKERS
from scenarios.experiments.workers.kinds import WorkerKind, Workers


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
    kind, _ = _chosen(options)
    kind.prepare()


def _chosen(options: argparse.Namespace) -> tuple[WorkerKind, str | None]:
    kinds = list(WORKERS.values())
    for kind in kinds:
        value: str | None = getattr(options, kind.option)
        if value is not None:
            return kind, value
    return kinds[0], None
