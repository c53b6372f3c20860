"""`rx90 compare`."""

import argparse
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from ident.support.naming import one_line
from scenarios.command_line.output import add_form_arguments, console, show, under_way
from scenarios.command_line.process import Status
from scenarios.command_line.study_arguments import interruptible, summary_of
from scenarios.experiments.workers import add_worker_options, open_workers, worker_words
from scenarios.results.write_access import make_folder, try_folder
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.benchmark.comparison.statistics import ComparedScenario
    from scenarios.benchmark.methods.call import Limits
    from scenarios.benchmark.methods.method import Method
    from scenarios.experiments.study import Study
    from scenarios.experiments.study_folder import StudyFolder

REPORT, DOCUMENT = "report.md", "report.json"
TIME = arguments.number_from(0.1, 86400.0, "s", "a tenth of a second to a day")
MEMORY = arguments.number_from(0.1, 1024.0, "GB", "an empty process takes 0.1 GB")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    said = "built-in names or paths of TOML files; or problem folders to be answered"
    add("subjects", nargs="*", metavar="SCENARIO|FOLDER", help=said)
    said = "an estimator, NAME or NAME,KEY=VALUE,...; package.module:function; or 'exec: COMMAND'; repeatable"
    add("--method", action="append", default=[], metavar="M", help=said)
    add("-n", type=arguments.count, dest="trials", metavar="N", help="trials of each scenario")
    add("--out", type=arguments.folder, metavar="DIR", help="folder of the comparison; finished trials in it are kept")
    add("--seed", type=arguments.seed, help="seed of the first trial (default 0; with --seal, a random one)")
    add(
        "--time-limit", type=TIME, default=60.0, metavar="S", help="longest time of a call of a method [s] (default 60)"
    )
    add(
        "--memory-limit",
        type=MEMORY,
        default=4.0,
        metavar="GB",
        help="largest memory of a call of a method, on Linux [GB] (default 4)",
    )
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--check", metavar="M", help="test one method for properties that every method should have")
    said = "write trials as problems, the true gains in separate files, and hashes of all"
    instead.add_argument("--seal", type=arguments.folder, metavar="DIR", help=said)
    instead.add_argument(
        "--open",
        type=arguments.folder,
        metavar="DIR",
        help="score answer files against the problems that --seal wrote there",
    )
    add_worker_options(parser)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Run every method on every trial and report scores; or test one method, seal problems, open them."""
    if options.check is not None:
        return _checked(options)
    if options.seal is not None:
        return _sealed(options)
    if options.open is not None:
        return _opened(options)
    if not options.method:
        raise ScenarioError("no method; name one with --method")
    from scenarios.benchmark.methods import method_of
    from scenarios.results.problem_folder import is_problem

    limits = _limits(options)
    methods = [method_of(text) for text in options.method]
    folders = [Path(subject) for subject in options.subjects if is_problem(Path(subject))]
    if not folders:
        return _compared(options, methods, limits)
    if len(folders) < len(options.subjects):
        raise ScenarioError("scenarios and problem folders are mixed; compare them separately")
    return _answered(options, folders, methods, limits)


def _saved(subjects: Sequence[str]) -> str:
    """Message for a result folder, which is neither a problem nor a scenario."""
    from scenarios.results.record import RECORD

    folder = next((subject for subject in subjects if (Path(subject) / RECORD).is_file()), None)
    if folder is None:
        return ""
    return (
        f"{one_line(folder)} is a saved result (rx90 report shows it; rx90 verify compares two gains files, as "
        "rx90 identify --gains-out writes them); "
    )


def _answered(options: argparse.Namespace, folders: list[Path], methods: "list[Method]", limits: "Limits") -> Status:
    """Save the answer of each method to each problem; existing answers are reused."""
    from scenarios.benchmark.methods.answers import ANSWERS, answered
    from scenarios.reports.answers import answers_report

    if options.out is None:
        raise ScenarioError("expected --out DIR, for the answers")
    make_folder(options.out)
    with under_way(options, "asking") as stages:
        rows = answered(folders, methods, limits, options.out / ANSWERS, stages=stages)
    show(answers_report(rows, options.out / ANSWERS), options)
    return Status.PASSED


def _sealed(options: argparse.Namespace) -> Status:
    """Write sealed problems."""
    from scenarios.benchmark.comparison.seal import PROBLEMS, SEAL, TRUTH, seal, unknown_seed
    from scenarios.experiments.scenario import load_scenario
    from scenarios.rendering.content import Paragraph, Report

    if not options.subjects or options.trials is None:
        raise ScenarioError("expected scenarios and -n N, to be sealed")
    try_folder(options.seal, one_line(options.seal))
    loaded = [load_scenario(name) for name in options.subjects]
    if options.seal.exists() and any(options.seal.iterdir()):
        raise ScenarioError(f"{options.seal}: is not empty; seal into a new folder")
    seed = unknown_seed(options.trials) if options.seed is None else options.seed
    with under_way(options, "preparing") as stages:
        sealed = seal(loaded, options.trials, seed, options.seal, stages=stages)
    said = (
        Paragraph(f"Publish {options.seal / PROBLEMS} and {options.seal / SEAL}."),
        Paragraph(f"Keep {options.seal / TRUTH} secret until the answers have arrived; then publish it."),
    )
    show(Report(f"{sealed.problems} problems sealed", said, sealed.model_dump(mode="json")), options)
    return Status.PASSED


def _opened(options: argparse.Namespace) -> Status:
    """Score answers with the sealed true gains."""
    from scenarios.benchmark.comparison.seal import SEAL, TRUTH, revealed, scored
    from scenarios.benchmark.comparison.statistics import ComparedScenario, Comparison, summaries
    from scenarios.benchmark.methods.answers import read_answers
    from scenarios.reports.comparison import comparison_report

    if not options.subjects:
        raise ScenarioError("expected files of answers, as rx90 compare FOLDER writes them")
    known = revealed(options.open / SEAL, options.open / TRUTH)
    answers = [row for name in options.subjects for row in read_answers(Path(name))]
    if not answers:
        raise ScenarioError("the files contain no answer")
    methods = list(dict.fromkeys(row.method for row in answers))
    found = [
        ComparedScenario(
            name=name,
            trials=rows["trial"].unique().size,
            unposed=0,
            methods=list(summaries(rows, methods, known.bound(name))),
        )
        for name, rows in scored(answers, known).items()
    ]
    about = _about(shlex.join(["rx90", "compare", "--open", str(options.open)]))
    show(comparison_report(Comparison(about=about, scenarios=found)), options)
    return Status.PASSED


def _limits(options: argparse.Namespace) -> "Limits":
    from scenarios.benchmark.methods.call import Limits

    return Limits(time_s=options.time_limit, memory_gb=options.memory_limit)


def _checked(options: argparse.Namespace) -> Status:
    """Test one method for required properties; status 1 if one is violated."""
    from scenarios.benchmark.comparison.contract import contract
    from scenarios.benchmark.methods import method_of
    from scenarios.reports.comparison import contract_report

    with under_way(options, "asking"):
        found = contract(method_of(options.check), _limits(options))
    show(contract_report(found), options)
    return Status.PASSED if found.passed else Status.MISSED


def _compared(options: argparse.Namespace, methods: "list[Method]", limits: "Limits") -> Status:
    from scenarios.benchmark.comparison.study import comparison
    from scenarios.command_line.writing import right_to_write
    from scenarios.experiments.scenario import load_scenario
    from scenarios.experiments.study import carry_out

    if not options.subjects or options.trials is None or options.out is None:
        raise ScenarioError(f"{_saved(options.subjects)}expected scenarios, -n N and --out DIR")
    loaded = [load_scenario(name) for name in options.subjects]
    names = [scenario.name for scenario in loaded]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"scenario {twice!r} is given twice; each has a folder of its name")
    held = right_to_write(options, options.out, (REPORT, DOCUMENT), command="rx90 compare --out")
    studies = [comparison(scenario, methods, limits, options.trials, options.seed or 0) for scenario in loaded]
    command = _command(options)
    make_folder(options.out)
    with interruptible(command), open_workers(options) as workers:
        folders = [
            carry_out(study, options.out / study.scenario.name, workers, command=command, console=console(options))
            for study in studies
        ]

    from scenarios.benchmark.comparison.statistics import Comparison
    from scenarios.reports.comparison import comparison_report
    from scenarios.reports.files import write_json, write_markdown

    found = [_summed_up(study, folder, methods) for study, folder in zip(studies, folders, strict=True)]
    report = comparison_report(Comparison(about=_about(command) | _elsewhere(methods), scenarios=found))
    with summary_of(options.out), held.writing():
        write_markdown(report, options.out / REPORT)
        write_json(report, options.out / DOCUMENT)
    show(report, options)
    return Status.PASSED


def _summed_up(study: "Study", folder: "StudyFolder", methods: "list[Method]") -> "ComparedScenario":
    from scenarios.benchmark.comparison.bound import gain_bound
    from scenarios.benchmark.comparison.statistics import NEEDED, ComparedScenario, summaries
    from scenarios.experiments.setup import setup_of

    rows = folder.table(NEEDED)
    trials, posed = (each["trial"].unique().size for each in (rows, rows.dropna(subset=["seconds"])))
    return ComparedScenario(
        name=study.scenario.name,
        trials=trials,
        unposed=trials - posed,
        methods=list(summaries(rows, [method.text for method in methods], gain_bound(setup_of(study.scenario)))),
    )


def _about(command: str) -> dict[str, str]:
    """Return what is needed to repeat a report."""
    from datetime import UTC, datetime

    from scenarios.support.versions import versions

    return {
        "Command": command,
        "Date": datetime.now(UTC).date().isoformat(),
        "Versions": ", ".join(f"{name} {version}" for name, version in versions().items()),
    }


def _elsewhere(methods: "list[Method]") -> dict[str, str]:
    """Return files and packages of external methods, if any."""
    told = [
        f"{method.text} with {', '.join(' '.join(pair) for pair in method.digests)}"
        for method in methods
        if method.digests
    ]
    return {"External methods": "; ".join(told)} if told else {}


def _command(options: argparse.Namespace) -> str:
    """Return the command that repeats or resumes it."""
    words = ["rx90", "compare", *options.subjects]
    for text in options.method:
        words += ["--method", text]
    words += ["-n", str(options.trials), "--out", str(options.out), "--seed", str(options.seed or 0)]
    words += ["--time-limit", f"{options.time_limit:g}", "--memory-limit", f"{options.memory_limit:g}"]
    return shlex.join([*words, *worker_words(options)])
