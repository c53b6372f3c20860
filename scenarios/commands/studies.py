"""The commands `rx90 monte-carlo` and `rx90 sensitivity`."""

import argparse
import shlex
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from scenarios.errors import FolderNotWritable, NoGains
from scenarios.files.schema import load_scenario
from scenarios.stopping import resumable
from scenarios.workers.choice import open_workers, worker_words

PASSED, MISSED = 0, 1


def run_monte_carlo(options: argparse.Namespace, console: Console) -> int:
    """Carry out, sum up, plot; 1 if some joint contradicts the scenario's pass rate."""
    from scenarios.studies.monte_carlo import monte_carlo
    from scenarios.studies.study import carry_out

    scenario = load_scenario(options.scenario)
    study = monte_carlo(scenario, options.trials, options.seed)
    command = _command("monte-carlo", options)
    with resumable(command), open_workers(options) as workers:
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
    with resumable(command), open_workers(options) as workers:
        folder = carry_out(study, options.out, workers, command=command, console=Console(stderr=True))
    from scenarios.reports.sensitivity import print_budgets, write_budgets
    from scenarios.studies.budget import budgets  # plots: after the work

    joints = [joint for joint, wanted in enumerate(scenario.table.tolerance.identifiable, 1) if wanted]
    found = budgets(folder.table(), list(scenario.table.sources), joints, options.seed)
    if not all(budget.costs for budget in found):
        silent = ", ".join(str(budget.joint) for budget in found if not budget.costs)
        raise NoGains(f"{options.out}: no trial gave a gain of joint {silent}; the rows say why, column `reason`")
    console.print(f"Scenario {scenario.name}, {study.count} trials, {len(scenario.table.sources)} error sources")
    print_budgets(found, console)
    with _summary(options.out):
        written = write_budgets(found, scenario, options.out)
    console.print(f"Rows in {options.out / 'trials'}; {', '.join(path.name for path in written)} in {options.out}.")
    return PASSED


@contextmanager
def _summary(folder: Path) -> Generator[None]:
    """What cannot be written of a summary loses no row."""
    try:
        yield
    except OSError as error:
        raise FolderNotWritable(
            f"{folder}: the summary cannot be written: {error.strerror or error}; the rows are there, make room and "
            "repeat the command"
        ) from error


def _command(name: str, options: argparse.Namespace) -> str:
    """The command that repeats or resumes a study."""
    words = ["rx90", name, options.scenario]
    if name == "monte-carlo":
        words += ["-n", str(options.trials)]
    else:
        words += ["--repeats", str(options.repeats), "--samples", str(options.samples)]
    return shlex.join([*words, "--out", str(options.out), "--seed", str(options.seed), *worker_words(options)])
