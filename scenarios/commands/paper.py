"""`rx90 paper`."""

import argparse

import scenarios.command_line.arguments as arguments
from scenarios.command_line.arguments import add_force_argument
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status

TEXT = "paper.md"
FIGURES = ("figure3.png", "figure3.svg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--out", type=arguments.folder, metavar="DIR", help="write paper.md, figures and raw numbers there"
    )
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Repeat the experiment; status 1 if a claim fails."""
    from scenarios.benchmark.paper.experiment import run_paper
    from scenarios.benchmark.paper.folder import FILES, case_rows, paper_result, write_raw_numbers
    from scenarios.command_line.writing import right_to_write
    from scenarios.rendering import write_report
    from scenarios.reports.files import write_figures
    from scenarios.reports.paper import paper_report

    held = None
    if options.out is not None:
        names = (TEXT, *FIGURES, *FILES)
        held = right_to_write(options, options.out, names, command="rx90 paper --out")
    with under_way(options, "preparing") as stages:
        result = run_paper(options.seed, stages=stages)
    report = paper_report(paper_result(result), case_rows("case 2", result.cases[1]), result.seed)
    if held is not None:
        with held.writing():
            write_figures(report, held.folder)
            write_report(report, held.folder / TEXT)
            write_raw_numbers(result, held.folder, command=options.command_line)
    show(report, options)
    return Status.PASSED if result.passed else Status.MISSED
