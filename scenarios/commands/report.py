"""`rx90 report`."""

import argparse
from pathlib import Path

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import under_way
from scenarios.command_line.process import Status, write

PAGE = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    said = "folder written by run, identify or check --save, or by monte-carlo, sensitivity, compare or paper --out"
    add("folder", metavar="DIR", type=arguments.folder, help=said)
    add("--out", type=arguments.file, metavar="FILE", help=f"the page (default DIR/{PAGE})")
    add("--no-picture", action="store_true", help="omit the picture of the arm, which takes seconds to render")
    arguments.add_force_argument(parser)


def main(options: argparse.Namespace) -> Status:
    """Read the folder, render the page."""
    from scenarios.command_line.writing import right_to_write
    from scenarios.rendering import Page, renderer
    from scenarios.results.pages import page_of, with_picture

    path: Path = options.out or options.folder / PAGE
    held = right_to_write(options, path.parent, [path.name], command="rx90 report")
    with under_way(options, "drawing"):
        report = page_of(options.folder)
        if not options.no_picture:
            report = with_picture(report, options.folder)
        text = renderer("html")(report, Page())
    with held.writing():
        path.write_text(text, encoding="utf-8", errors="backslashreplace")
    write(f"{path}: {len(text.encode(errors='backslashreplace')) / 1e6:.2f} MB, open it in any browser\n")
    return Status.PASSED
