"""`rx90 compare`."""

import argparse
import shlex
from typing import TYPE_CHECKING

import scenarios.commands.arguments as arguments
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.status import Status
from scenarios.commands.study import interruptible, summary_of
from scenarios.errors import NothingToCompare
from scenarios.workers.choice import add_worker_options, open_workers, prepare_workers, worker_words

if TYPE_CHECKING:
    from scenarios.methods.method import Method
    from scenarios.methods.process import Limits
    from scenarios.reports.comparison import Compared
    from scenarios.store.study_folder import StudyFolder
    from scenarios.studies.study import Study

REPORT, DOCUMENT = "report.md", "report.json"
TIME = arguments.number_from(0.1, 86400.0, "s", "a tenth of a second to a day")
MEMORY = arguments.number_from(0.1, 1024.0, "GB", "0.1 is what an empty process takes")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenarios", nargs="*", metavar="SCENARIO", help="built-in names or paths of TOML files")
    add(
        "--method",
        action="append",
        default=[],
        metavar="M",
        help="an estimator, NAME or NAME,KEY=VALUE,...; package.module:function; or 'exec: COMMAND'; repeatable",
    )
    add("--check", metavar="M", help="ask a method for what any method should keep, and compare nothing")
    add("-n", type=arguments.count, dest="trials", metavar="N", help="trials of each scenario")
    add("--out", type=arguments.folder, metavar="DIR", help="folder of the comparison; what it already holds is kept")
    add("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    add("--time-limit", type=TIME, default=60.0, metavar="S", help="of each call of a method [s] (default 60)")
    add("--memory-limit", type=MEMORY, default=4.0, metavar="GB", help="likewise, on Linux [GB] (default 4)")
    add_worker_options(parser)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Give every trial to every method, tell who solved what."""
    from scenarios.methods.process import Limits

    limits = Limits(time_s=options.time_limit, memory_gb=options.memory_limit)
    if options.check is not None:
        return _checked(options, limits)
    if not options.method:
        raise NothingToCompare("no method; name one with --method")
    prepare_workers(options)
    from scenarios.methods import method_of

    methods = [method_of(text) for text in options.method]
    return _compared(options, methods, limits)


def _checked(options: argparse.Namespace, limits: "Limits") -> Status:
    """Ask one method for what any method should keep; 1 if a promise is broken."""
    from scenarios.comparison.contract import checks
    from scenarios.methods import method_of
    from scenarios.reports.contract import contract_report

    found = list(checks(method_of(options.check), limits))
    show(contract_report(options.check, found), options)
    return Status.PASSED if all(check.broken is None for check in found) else Status.MISSED


def _compared(options: argparse.Namespace, methods: "list[Method]", limits: "Limits") -> Status:
    from rich.console import Console

    from scenarios.files.schema import load_scenario
    from scenarios.store.claim import claim
    from scenarios.studies.comparison import comparison
    from scenarios.studies.study import carry_out

    if not options.scenarios or options.trials is None or options.out is None:
        raise NothingToCompare("expected scenarios, -n N and --out DIR")
    loaded = [load_scenario(name) for name in options.scenarios]
    names = [scenario.name for scenario in loaded]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise NothingToCompare(f"scenario {twice!r} is given twice; each has a folder of its name")
    held = claim(options.out, (REPORT, DOCUMENT), command="rx90 compare --out", force=options.force)
    studies = [comparison(scenario, methods, limits, options.trials, options.seed) for scenario in loaded]
    command = _command(options)
    options.out.mkdir(parents=True, exist_ok=True)
    with interruptible(command), open_workers(options) as workers:
        folders = [
            carry_out(study, options.out / study.scenario.name, workers, command=command, console=Console(stderr=True))
            for study in studies
        ]

    from scenarios.reports.comparison import comparison_report  # tables: after the work
    from scenarios.reports.files import write_json, write_markdown

    found = [_summed_up(study, folder, methods) for study, folder in zip(studies, folders, strict=True)]
    report = comparison_report(found, _about(command))
    with summary_of(options.out), held.writing():
        write_markdown(report, options.out / REPORT)
        write_json(report, options.out / DOCUMENT)
    show(report, options)
    return Status.PASSED


def _summed_up(study: "Study", folder: "StudyFolder", methods: "list[Method]") -> "Compared":
    from scenarios.build import bench
    from scenarios.comparison.bound import gain_bound
    from scenarios.comparison.statistics import NEEDED, summaries
    from scenarios.reports.comparison import Compared

    rows = folder.table(NEEDED)
    trials, posed = (each["trial"].unique().size for each in (rows, rows.dropna(subset=["seconds"])))
    return Compared(
        name=study.scenario.name,
        trials=trials,
        unposed=trials - posed,
        methods=summaries(rows, [method.text for method in methods], gain_bound(bench(study.scenario))),
    )


def _about(command: str) -> dict[str, str]:
    """What a report must say so that it can be repeated."""
    from datetime import UTC, datetime

    from scenarios.versions import versions

    return {
        "Command": command,
        "Date": datetime.now(UTC).date().isoformat(),
        "Versions": ", ".join(f"{name} {version}" for name, version in versions().items()),
    }


def _command(options: argparse.Namespace) -> str:
    """The command that repeats or resumes it."""
    words = ["rx90", "compare", *options.scenarios]
    for text in options.method:
        words += ["--method", text]
    words += ["-n", str(options.trials), "--out", str(options.out), "--seed", str(options.seed)]
    words += ["--time-limit", f"{options.time_limit:g}", "--memory-limit", f"{options.memory_limit:g}"]
    return shlex.join([*words, *worker_words(options)])
