"""The commands `rx90 monte-carlo` and `rx90 sensitivity`."""

import argparse
import os
import shlex
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from scenarios.errors import StudyError
from scenarios.files.schema import load_scenario
from scenarios.workers.executors import Workers, dask_workers, local_processes, usable_cores

PASSED, MISSED, INTERRUPTED = 0, 1, 130
PATIENCE = 5.0
"""How long an interrupted study may take to end [s]."""


def run_monte_carlo(options: argparse.Namespace, console: Console) -> int:
    """Carry out, sum up, plot; 1 if some joint contradicts the scenario's pass rate."""
    from scenarios.studies.monte_carlo import monte_carlo
    from scenarios.studies.study import carry_out

    scenario = load_scenario(options.scenario)
    study = monte_carlo(scenario, options.trials, options.seed)
    command = _command("monte-carlo", options)
    with _interruptible(command), _workers(options) as workers:
        folder = carry_out(study, options.out, workers, command=command, console=Console(stderr=True))
    from scenarios.reports.monte_carlo import print_monte_carlo, write_monte_carlo  # plots: after the work
    from scenarios.studies.pass_rule import FALSE_ALARM
    from scenarios.studies.statistics import COLUMNS, joint_statistics

    rows = folder.table([*COLUMNS, "tolerance"])
    statistics = joint_statistics(rows, wanted=scenario.table.tolerance.pass_rate, false_alarm=FALSE_ALARM)
    trials = statistics[0].trials
    more = f" (the folder holds more than the {options.trials} asked for)" if trials > options.trials else ""
    console.print(f"Scenario {scenario.name}, {trials} trials from seed {options.seed}{more}")
    print_monte_carlo(statistics, rows, console)
    with _summary(options.out):
        written = write_monte_carlo(statistics, rows, scenario, options.out)
    console.print(f"Rows in {options.out / 'trials'}; {', '.join(path.name for path in written)} in {options.out}.")
    return PASSED if all(joint.held for joint in statistics) else MISSED


def run_sensitivity(options: argparse.Namespace, console: Console) -> int:
    """Carry out both designs, rank the error sources."""
    from scenarios.studies.sensitivity import sensitivity
    from scenarios.studies.study import carry_out

    scenario = load_scenario(options.scenario)
    study = sensitivity(scenario, repeats=options.repeats, samples=options.samples, seed=options.seed)
    command = _command("sensitivity", options)
    with _interruptible(command), _workers(options) as workers:
        folder = carry_out(study, options.out, workers, command=command, console=Console(stderr=True))
    from scenarios.reports.sensitivity import print_budgets, write_budgets
    from scenarios.studies.budget import budgets  # plots: after the work

    joints = [joint for joint, wanted in enumerate(scenario.table.tolerance.identifiable, 1) if wanted]
    found = budgets(folder.table(), list(scenario.table.sources), joints, options.seed)
    if not all(budget.costs for budget in found):
        silent = ", ".join(str(budget.joint) for budget in found if not budget.costs)
        raise StudyError(f"{options.out}: no trial gave a gain of joint {silent}; the rows say why, column `reason`")
    console.print(f"Scenario {scenario.name}, {study.count} trials, {len(scenario.table.sources)} error sources")
    print_budgets(found, console)
    with _summary(options.out):
        written = write_budgets(found, scenario, options.out)
    console.print(f"Rows in {options.out / 'trials'}; {', '.join(path.name for path in written)} in {options.out}.")
    return PASSED


@contextmanager
def _workers(options: argparse.Namespace) -> Generator[Workers]:
    with dask_workers(options.dask) if options.dask else local_processes(options.jobs or usable_cores()) as workers:
        yield workers


@contextmanager
def _summary(folder: Path) -> Generator[None]:
    """What cannot be written of a summary loses no row."""
    try:
        yield
    except OSError as error:
        raise StudyError(
            f"{folder}: the summary cannot be written: {error.strerror or error}; the rows are there, make room and "
            "repeat the command"
        ) from error


@contextmanager
def _interruptible(command: str) -> Generator[None]:
    """On Ctrl-C, say how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        print(f"rx90: stopped; what is finished is kept, go on with: {command}", file=sys.stderr)  # noqa: T201
        leave = threading.Timer(PATIENCE, os._exit, [INTERRUPTED])  # should Python wait for a pool cut off half-way
        leave.daemon = True
        leave.start()
        raise SystemExit(INTERRUPTED) from None


def _command(name: str, options: argparse.Namespace) -> str:
    """The command that repeats or resumes a study."""
    words = ["rx90", name, options.scenario]
    if name == "monte-carlo":
        words += ["-n", str(options.trials)]
    else:
        words += ["--repeats", str(options.repeats), "--samples", str(options.samples)]
    words += ["--out", str(options.out), "--seed", str(options.seed)]
    if options.dask:
        words += ["--dask", options.dask]
    elif options.jobs:
        words += ["--jobs", str(options.jobs)]
    return shlex.join(words)
