"""Commands of many trials: `rx90 predict` (without any), `sensitivity`, `monte-carlo` and `compare`."""

import argparse
import os
import shlex
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scenarios.command_line import arguments, output
from scenarios.command_line.process import Status, complain, ending
from scenarios.experiments.workers import add_worker_options, open_workers
from scenarios.rendering.content import Paragraph
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.experiments.study import Study
    from scenarios.experiments.study_folder import StudyFolder

PATIENCE = 5.0
"""Timeout for the end of an interrupted study [s]."""
REPORT = "report.md"
TIME = arguments.number_from(0.1, 86400.0, "s", "a tenth of a second to a day")
MEMORY = arguments.number_from(0.1, 1024.0, "GB", "an empty process takes 0.1 GB")


def predict_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario and method."""
    from ident.estimation.estimators import ESTIMATORS

    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file, with error sources")
    known = ", ".join(ESTIMATORS)
    add("--method", metavar="M", choices=ESTIMATORS, help=f"estimator: {known} (default the scenario's)")
    add("--option", action="append", default=[], metavar="KEY=VALUE", help="an option of the method; repeatable")


def predict_command(options: argparse.Namespace) -> Status:
    """Predict the error budget of a scenario."""
    from scenarios.experiments.scenario import load_scenario, with_method
    from scenarios.prediction.budget import predicted_budget

    scenario = with_method(load_scenario(options.scenario), options.method, options.option)
    with output.under_way(options, "predicting"):
        budget = predicted_budget(scenario)
    return output.show(budget.report(budget.title), options)


def _add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, folder, seed, workers and output format."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    text = "folder of the study; finished trials in it are kept"
    parser.add_argument("--out", type=arguments.folder, required=True, metavar="DIR", help=text)
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    add_worker_options(parser)


def monte_carlo_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the number of trials, and what every study has."""
    parser.add_argument("-n", type=arguments.count, required=True, dest="trials", metavar="N", help="number of trials")
    _add_study_arguments(parser)


def monte_carlo_command(options: argparse.Namespace) -> Status:
    """Run trials with different seeds; status 1 if a joint contradicts the scenario's pass rate."""
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import monte_carlo

    scenario = load_scenario(options.scenario)
    folder = _carried_out(monte_carlo(scenario, options.trials, options.seed), options)
    from scenarios.experiments.statistics import COLUMNS
    from scenarios.results.studies import StudyResult

    result = StudyResult.of(scenario, options.seed, folder.table(COLUMNS))
    rows = Paragraph(f"Rows in {options.out / 'trials'}.")
    return output.show(result.report(result.title(options.trials), rows), options, passed=result.passed)


def sensitivity_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the numbers of trials, and what every study has."""
    text = "trials of each source alone, a power of 2 (default 16)"
    parser.add_argument("--repeats", type=arguments.count, default=16, help=text)
    text = "rows of the Sobol design, a power of 2 (default 64)"
    parser.add_argument("--samples", type=arguments.count, default=64, help=text)
    _add_study_arguments(parser)


def sensitivity_command(options: argparse.Namespace) -> Status:
    """Run each error source alone and all of them together, rank them."""
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import sensitivity

    scenario = load_scenario(options.scenario)
    study = sensitivity(scenario, repeats=options.repeats, samples=options.samples, seed=options.seed)
    folder = _carried_out(study, options)
    from scenarios.results.sensitivity import Budget

    found = Budget.of(scenario, study.count, folder, options.seed)
    rows = Paragraph(f"Rows in {options.out / 'trials'}.")
    return output.show(found.report(found.title(len(scenario.table.sources)), rows), options)


def compare_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenarios, methods and their limits."""
    add = parser.add_argument
    add("scenarios", nargs="+", metavar="SCENARIO", help="built-in names or paths of TOML files")
    text = "an estimator, NAME or NAME,KEY=VALUE,...; package.module:function; or 'exec: COMMAND'; repeatable"
    add("--method", action="append", required=True, metavar="M", help=text)
    add("-n", type=arguments.count, required=True, dest="trials", metavar="N", help="trials of each scenario")
    text = "folder of the comparison; finished trials in it are kept"
    add("--out", type=arguments.folder, required=True, metavar="DIR", help=text)
    add("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    text = "longest time of a call of a method [s] (default %(default)g)"
    add("--time-limit", type=TIME, default=60.0, metavar="S", help=text)
    text = "largest memory of a call of a method, on Linux [GB] (default %(default)g)"
    add("--memory-limit", type=MEMORY, default=4.0, metavar="GB", help=text)
    add_worker_options(parser)
    output.add_force_argument(parser)


def compare_command(options: argparse.Namespace) -> Status:
    """Run every method on every trial; report scores, errors and coverage; status 1 if no trial reached a method."""
    from datetime import UTC, datetime

    from scenarios.benchmark.methods import Limits, method_of

    methods = [method_of(text) for text in options.method]
    from scenarios.benchmark.comparison import DOCUMENT, NEEDED, Comparison, compared
    from scenarios.benchmark.study import comparison
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import carry_out
    from scenarios.rendering import write_report
    from scenarios.rendering.result import to_json
    from scenarios.support.digests import with_digest
    from scenarios.support.versions import versions

    loaded = [load_scenario(name) for name in options.scenarios]
    names = [scenario.name for scenario in loaded]
    for twice in (name for name in names if names.count(name) > 1):
        raise ScenarioError(f"scenario {twice!r} is given twice; each has a folder of its name")
    claim = output.right_to_write(options, options.out, (REPORT, DOCUMENT), command="rx90 compare --out")
    limits = Limits(time_s=options.time_limit, memory_gb=options.memory_limit)
    studies = [comparison(scenario, methods, limits, options.trials, options.seed) for scenario in loaded]
    command, console = options.command_line, output.console(options)
    with interruptible(command), open_workers(options) as workers:
        folders = [
            carry_out(each, options.out / each.scenario.name, workers, command=command, console=console)
            for each in studies
        ]
    about = {
        "Command": command,
        "Date": datetime.now(UTC).date().isoformat(),
        "Versions": ", ".join(f"{name} {version}" for name, version in versions().items()),
    }
    if external := [f"{x.text} with {', '.join(map(' '.join, x.digests))}" for x in methods if x.digests]:
        about["External methods"] = "; ".join(external)
    texts = [method.text for method in methods]
    rows = [folder.table(NEEDED) for folder in folders]
    found = Comparison(about=about, scenarios=[compared(*of, texts) for of in zip(names, rows, strict=True)])
    report = found.report(found.title, *(Paragraph(f"{key}: {text}.") for key, text in about.items()))
    with claim.writing():
        write_report(report, options.out / REPORT)
        text = to_json(with_digest(report.document))
        (options.out / DOCUMENT).write_text(f"{text}\n", encoding="utf-8")
    return output.show(report, options, passed=found.ran)


def _carried_out(study: "Study", options: argparse.Namespace) -> "StudyFolder":
    """Run a study with the workers of the options; the recorded command names the scenario first."""
    from scenarios.experiments.study import carry_out

    program, name, *words = shlex.split(options.command_line)
    words.remove(options.scenario)
    command = shlex.join([program, name, options.scenario, *words])
    with interruptible(command), open_workers(options) as workers:
        return carry_out(study, options.out, workers, command=command, console=output.console(options))


@contextmanager
def interruptible(command: str) -> Generator[None]:
    """On Ctrl-C or a signal, print how to continue."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        complain(f"stopped; finished trials are kept; continue with: {command}")
        status = ending(interrupt)
        leave = threading.Timer(PATIENCE, os._exit, [status])  # in case Python waits for an interrupted pool
        leave.daemon = True
        leave.start()
        sys.unraisablehook = lambda _: None  # errors at exit are irrelevant
        raise SystemExit(status) from None
