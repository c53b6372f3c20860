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
    from scenarios.benchmark.paper import case_rows, run_paper, write_paper
    from scenarios.benchmark.paper_result import DRAWN, FILES, figure_3
    from scenarios.command_line.writing import right_to_write
    from scenarios.rendering import write_report
    from scenarios.rendering.drawing import figure

    held = None
    if options.out is not None:
        names = (TEXT, *FIGURES, *FILES)
        held = right_to_write(options, options.out, names, command="rx90 paper --out")
    with under_way(options, "preparing") as stages:
        run = run_paper(options.seed, stages=stages)
    found = run.result
    report = found.report(found.title(run.seed))
    if held is not None:
        with held.writing():
            name = f"case {DRAWN}"
            drawn = figure(figure_3(case_rows(name, run.estimates[name]), found.cases[DRAWN - 1]))
            for file in FIGURES:
                drawn.savefig(held.folder / file)
            write_report(report, held.folder / TEXT)
            write_paper(run, held.folder, command=options.command_line)
    show(report, options)
    return Status.PASSED if found.passed else Status.MISSED
