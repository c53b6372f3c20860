"""What a bad file ends with: one line that names it."""

import re
from pathlib import Path

from scenarios.cli import main


def names_file(line: str, path: Path, message: str) -> None:
    assert path.name in line
    assert len(line) < 500
    assert re.search(message, line), line


def refused(capsys, words: list[str]) -> str:
    """The one line with which a command refuses its words, with status 2 and nothing on standard output."""
    capsys.readouterr()
    try:
        status = main(words)
    except SystemExit as ended:
        status = ended.code
    out, line = capsys.readouterr()
    assert (status, out, line.count("\n"), len(line) < 700, line[:4]) == (2, "", 1, True, "rx90"), words
    return line
