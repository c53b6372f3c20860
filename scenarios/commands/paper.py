"""`rx90 paper`."""

import argparse

import scenarios.commands.arguments as arguments
from scenarios.commands.status import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--out", type=arguments.folder, metavar="DIR", help="write paper.md, figures and raw numbers there"
    )
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of tables")


def main(options: argparse.Namespace) -> Status:
    """Repeat the experiment; 1 if a claim fails."""
    from scenarios.commands.output import terminal
    from scenarios.paper.experiment import run_paper
    from scenarios.reports.paper import paper_document, print_paper, write_paper
    from scenarios.store.run_folder import to_json

    console = terminal()
    result = run_paper(options.seed)
    if options.out is not None:
        write_paper(result, options.out)
    if options.json:
        console.out(to_json(paper_document(result)), highlight=False)
    else:
        print_paper(result, console)
    return Status.PASSED if result.passed else Status.MISSED
