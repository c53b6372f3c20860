"""`rx90 schema`."""

import argparse
import json

from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status, write
from scenarios.rendering.content import Paragraph, Report, pairs_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    from scenarios.results.json_schemas import FILES, RESULTS

    said = "schema of a file or of a command's --json output (default: list all)"
    parser.add_argument("name", nargs="?", metavar="NAME", choices=list(FILES | RESULTS), help=said)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Print a schema, or list all of them."""
    from scenarios.results.json_schemas import FILES, RESULTS, schema
    from scenarios.support.texts import ENDING, FOLDER

    if options.name is not None:
        write(json.dumps(schema(options.name), indent=2) + "\n")
        return Status.PASSED
    about = {name: str(schema(name)["description"]).partition("\n")[0] for name in FILES | RESULTS}
    said = Paragraph(f"rx90 schema NAME prints one; those of TOML files are also in {FOLDER}.")
    document = {
        name: {"about": text} | ({"file": str(FOLDER / f"{name}{ENDING}")} if name in FILES else {})
        for name, text in about.items()
    }
    show(
        Report("JSON Schemas of files and results", (pairs_table("Schema", "Describes", about), said), document),
        options,
    )
    return Status.PASSED
