"""`rx90 compare`."""

import argparse
import shlex
from datetime import UTC, datetime
from pathlib import Path

import scenarios.command_line.arguments as arguments
from ident.support.naming import one_line
from scenarios.command_line.output import add_form_arguments, console, show
from scenarios.command_line.process import Status
from scenarios.command_line.study_arguments import interruptible, summary_of
from scenarios.experiments.workers import add_worker_options, open_workers, worker_words
from scenarios.results.write_access import make_folder
from scenarios.support.errors import ScenarioError

REPORT = "report.md"
TIME = arguments.number_from(0.1, 86400.0, "s", "a tenth of a second to a day")
MEMORY = arguments.number_from(0.1, 1024.0, "GB", "an empty process takes 0.1 GB")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenarios", nargs="*", metavar="SCENARIO", help="built-in names or paths of TOML files")
    said = "an estimator, NAME or NAME,KEY=VALUE,...; package.module:function; or 'exec: COMMAND'; repeatable"
    add("--method", action="append", default=[], metavar="M", help=said)
    add("-n", type=arguments.count, dest="trials", metavar="N", help="trials of each scenario")
    add("--out", type=arguments.folder, metavar="DIR", help="folder of the comparison; finished trials in it are kept")
    add("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
    said = "longest time of a call of a method [s] (default %(default)g)"
    add("--time-limit", type=TIME, default=60.0, metavar="S", help=said)
    said = "largest memory of a call of a method, on Linux [GB] (default %(default)g)"
    add("--memory-limit", type=MEMORY, default=4.0, metavar="GB", help=said)
    add_worker_options(parser)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Run every method on every trial; report scores, errors and coverage."""
    if not options.method:
        raise ScenarioError("no method; name one with --method")
    from scenarios.benchmark.methods import Limits, method_of

    methods = [method_of(text) for text in options.method]
    if not options.scenarios or options.trials is None or options.out is None:
        raise ScenarioError(f"{_saved(options.scenarios)}expected scenarios, -n N and --out DIR")
    from scenarios.benchmark.bound import gain_bound
    from scenarios.benchmark.comparison import DOCUMENT, NEEDED, Comparison, compared
    from scenarios.benchmark.study import comparison
    from scenarios.command_line.writing import right_to_write
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.experiments.study import carry_out
    from scenarios.rendering import write_report
    from scenarios.rendering.content import Paragraph
    from scenarios.support.versions import versions

    loaded = [load_scenario(name) for name in options.scenarios]
    names = [scenario.name for scenario in loaded]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"scenario {twice!r} is given twice; each has a folder of its name")
    held = right_to_write(options, options.out, (REPORT, DOCUMENT), command="rx90 compare --out")
    limits = Limits(time_s=options.time_limit, memory_gb=options.memory_limit)
    studies = [comparison(scenario, methods, limits, options.trials, options.seed) for scenario in loaded]
    words = [word for text in options.method for word in ("--method", text)]
    words += ["-n", str(options.trials), "--out", str(options.out), "--seed", str(options.seed)]
    words += ["--time-limit", f"{options.time_limit:g}", "--memory-limit", f"{options.memory_limit:g}"]
    command = shlex.join(["rx90", "compare", *options.scenarios, *words, *worker_words(options)])
    make_folder(options.out)
    with interruptible(command), open_workers(options) as workers:
        folders = [
            carry_out(study, options.out / study.scenario.name, workers, command=command, console=console(options))
            for study in studies
        ]
    about = {
        "Command": command,
        "Date": datetime.now(UTC).date().isoformat(),
        "Versions": ", ".join(f"{name} {version}" for name, version in versions().items()),
    }
    files = {method.text: ", ".join(map(" ".join, method.digests)) for method in methods if method.digests}
    if files:
        about["External methods"] = "; ".join(f"{text} with {named}" for text, named in files.items())
    texts = [method.text for method in methods]
    scenarios = [
        compared(scenario.name, folder.table(NEEDED), texts, gain_bound(setup_of(scenario)))
        for scenario, folder in zip(loaded, folders, strict=True)
    ]
    found = Comparison(about=about, scenarios=scenarios)
    report = found.report(found.title, *(Paragraph(f"{key}: {text}.") for key, text in about.items()))
    with summary_of(options.out), held.writing():
        write_report(report, options.out / REPORT)
        write_report(report, options.out / DOCUMENT)
    show(report, options)
    return Status.PASSED if found.ran else Status.MISSED


def _saved(names: list[str]) -> str:
    """Message for a result folder, which is no scenario."""
    from scenarios.results.record import RECORD

    folder = next((name for name in names if (Path(name) / RECORD).is_file()), None)
    if folder is None:
        return ""
    return (
        f"{one_line(folder)} is a saved result (rx90 report shows it; rx90 verify compares two gains files, as "
        "rx90 identify --gains-out writes them); "
    )
