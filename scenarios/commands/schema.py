"""`rx90 schema`."""

import argparse
import json
from pathlib import Path

from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status, write
from scenarios.experiments.files.toml_text import ENDING, FOLDER
from scenarios.rendering.content import Paragraph, Report, pairs_table


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    said = "schema of a file or of a command's --json output (default: list all)"
    parser.add_argument("name", nargs="?", metavar="NAME", choices=list(_files()), help=said)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Print a schema, or list all of them."""
    files = _files()
    if options.name is not None:
        write(files[options.name].read_text(encoding="utf-8"))
        return Status.PASSED
    about = {name: str(json.loads(path.read_text(encoding="utf-8"))["description"]) for name, path in files.items()}
    first = {name: said.partition("\n")[0] for name, said in about.items()}
    said = Paragraph(f"rx90 schema NAME prints one; the files are in {FOLDER}.")
    document = {name: {"about": first[name], "file": str(path)} for name, path in files.items()}
    parts = pairs_table("Schema", "Describes", first), said
    show(Report("JSON Schemas of files and results", parts, document), options)
    return Status.PASSED


def _files() -> dict[str, Path]:
    """Schemas by name."""
    return {path.name.removesuffix(ENDING): path for path in sorted(FOLDER.glob(f"*{ENDING}"))}
