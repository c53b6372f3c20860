"""The page of all commands, from their parsers."""

import argparse
import os

from scenarios.cli import OneLineParser
from scenarios.command_line.process import Status
from scenarios.commands import EXAMPLES, GROUPS, command

HEAD = """# Commands

`rx90 COMMAND --help` says the same. Results are printed as text that fits the terminal, in colours unless NO_COLOR is
set; `--format` chooses Markdown, an HTML page or one JSON object (`--json`). Errors go to standard error, and, if that
is a terminal, progress, which `--quiet` omits. A file is overwritten only if the same command wrote it and it has not
been changed since, or with `--force`.

"""
STATUSES = """## Exit statuses

| status | means |
|---|---|
"""


def commands_page() -> str:
    """Every command with its arguments, then the exit statuses."""
    os.environ["COLUMNS"] = "100"
    sections = ""
    for group, members in GROUPS.items():
        sections += f"## {group[0].upper()}{group[1:]}\n\n" + "\n".join(map(_section, members, members.values()))
    return HEAD + sections + STATUSES + "".join(f"| {s:d} | {_cell(s.meaning)} |\n" for s in Status)


def _section(name: str, summary: str) -> str:
    parser = OneLineParser(prog=f"rx90 {name}", add_help=False)
    command(name).add_arguments(parser)
    usage = " ".join(parser.format_usage().removeprefix("usage: ").split())
    text = f"### rx90 {name}\n\n{summary[0].upper()}{summary[1:]}.\n\n```text\n{_folded(usage)}\n```\n\n"
    text += "```sh\n" + "".join(f"{line}\n" for line in EXAMPLES if line.split()[1] == name) + "```\n\n"
    rows = [_row(parser, action) for action in parser._actions if action.help != argparse.SUPPRESS]
    return text + ("| argument | what |\n|---|---|\n" + "".join(rows) + "\n" if rows else "")


def _folded(usage: str, width: int = 74) -> str:
    """The usage, broken between arguments."""
    lines, depth, words, word = [""], 0, [], ""
    for letter in usage + " ":
        depth += (letter in "([") - (letter in ")]")
        if letter == " " and not depth:
            words.append(word)
            word = ""
        else:
            word += letter
    for each in words:
        if lines[-1] and len(lines[-1]) + len(each) >= width:
            lines.append("   ")
        lines[-1] += f"{' ' if lines[-1] else ''}{each}"
    return "\n".join(lines)


def _row(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    formatter = parser._get_formatter()  # what --help says, of which argparse has no public form
    named = formatter._format_args(action, formatter._get_default_metavar_for_optional(action))
    if action.option_strings:
        names = ", ".join(f"`{name}{' ' + named if action.nargs != 0 else ''}`" for name in action.option_strings)
    else:
        names = f"`{formatter._format_args(action, formatter._get_default_metavar_for_positional(action))}`"
    needed = " (needed)" if action.required and action.option_strings else ""
    return f"| {_cell(names)} | {_cell(formatter._expand_help(action) if action.help else '')}{needed} |\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")
