"""`rx90 paper`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.status import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--out", type=arguments.folder, metavar="DIR", help="write paper.md, figures and raw numbers there"
    )
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Repeat the experiment; 1 if a claim fails."""
    from scenarios.paper.experiment import run_paper
    from scenarios.reports.files import write_figures, write_markdown
    from scenarios.reports.paper import paper_report
    from scenarios.store.paper_folder import write_raw_numbers

    result = run_paper(options.seed)
    report = paper_report(result)
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        write_figures(report, options.out)
        write_markdown(report, options.out / "paper.md")
        write_raw_numbers(result, options.out)
    show(report, options)
    return Status.PASSED if result.passed else Status.MISSED
