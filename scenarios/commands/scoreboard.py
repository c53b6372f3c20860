"""`rx90 scoreboard`."""

import argparse
from pathlib import Path

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.support.errors import ScenarioError

PAGE = "scoreboard.html"
METHODS = ("nls", "ls-2011", "iv")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("folder", type=arguments.folder, metavar="DIR", help="folder of downloaded recordings")
    said = f"method, as in rx90 compare; repeatable (default {', '.join(METHODS)})"
    add("--method", action="append", default=[], metavar="M", help=said)
    add(
        "--recipe", type=arguments.file, action="append", default=[], metavar="FILE", help="one more recipe; repeatable"
    )
    add(
        "--out",
        type=arguments.folder,
        required=True,
        metavar="OUT",
        help=f"folder of {PAGE}, problems and answers; answers in it are reused",
    )
    add("--time-limit", type=arguments.number_from(0.1, 86400.0, "s", "a tenth of a second to a day"), default=300.0,
        metavar="S", help="longest time of a call of a method [s] (default %(default)g)")  # fmt: skip
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Run every method, write the page; status 1 without recordings, or if an unidentifiable gain is given."""
    from scenarios.benchmark.methods import method_of
    from scenarios.benchmark.methods.call import Limits
    from scenarios.benchmark.scoreboard.board import ANSWERS, scoreboard
    from scenarios.benchmark.scoreboard.recipes import recipes
    from scenarios.reports.renderers import Page, renderer
    from scenarios.reports.scoreboard import scoreboard_report
    from scenarios.results.write_access import check_own_folder

    folder: Path = options.folder
    if not folder.is_dir():
        raise ScenarioError(f"{folder}: no such folder; expected the folder of downloaded recordings")
    methods = [method_of(text) for text in options.method or METHODS]
    wanted = recipes(options.recipe)
    check_own_folder(options.out, "rx90 scoreboard")
    held = right_to_write(options, options.out, [PAGE, ANSWERS], command="rx90 scoreboard")
    with under_way(options, "reading") as stages, held.writing():
        limits = Limits(time_s=options.time_limit)
        found = scoreboard(folder, wanted, methods, limits, options.out, stages=stages)
        report = scoreboard_report(found)
        (options.out / PAGE).write_text(renderer("html")(report, Page()), encoding="utf-8")
    show(report, options)
    wrong = any(each.wrong for entry in found.entries for each in entry.refusals)
    nothing = all(entry.status != "run" for entry in found.entries)
    failed = wrong or nothing or any(entry.status == "unusable" for entry in found.entries)
    return Status.MISSED if failed else Status.PASSED
