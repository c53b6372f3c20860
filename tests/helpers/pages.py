"""Pages of the site as programs: their blocks, in order, in a folder.

A block with a `title` is a file. One of `sh` or `console` is commands, one of `python` without a title is run with what
the blocks before it have left. A block that cannot run says why in the line before it, `<!-- not run: reason -->`, and
a page that goes on in the folder of another one names it, `<!-- after: page.md -->`. Blocks of `text` are nobody's
commands.
"""

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Generator
from dataclasses import dataclass
from glob import glob
from pathlib import Path

from places import ROOT

from scenarios.cli import main

DOCS = ROOT / "docs"
MODELS = "rx90_mjcf"
FENCE = re.compile(r"^( *)(```+)(?:\{ \.)?(\w+)([^\n]*)\n(.*?)^\1\2$", re.MULTILINE | re.DOTALL)
INCLUDED = re.compile(r'^--8<-- "([^"]+)"$', re.MULTILINE)
MARK = re.compile(r"<!-- not run: ([^\n]+) -->\s*\Z")
AFTER = re.compile(r"^<!-- after: (\S+) -->$", re.MULTILINE)
STATUS = re.compile(r"\s+# exit status (\d+)$")
PROSE = ("text",)
SHELLS = ("sh", "console")
SECONDS = re.compile(r"\d+(?:\.\d+)? s\b")
"""Measured times, which differ from run to run."""


@dataclass(frozen=True)
class Block:
    """One block.

    Attributes:
        kind: Its language.
        file: Its title, empty for commands.
        text: What is in it, included files resolved.
        line: Where it begins, from 1.
        reason: Why it is not run, empty if it is.
    """

    kind: str
    file: str
    text: str
    line: int
    reason: str


def blocks(page: Path) -> list[Block]:
    """The blocks of a page that are files, commands or code."""
    text = page.read_text(encoding="utf-8")
    found: list[Block] = []
    for fence in FENCE.finditer(text):
        indent, _, kind, info, content = fence.groups()
        if kind in PROSE:
            continue
        content = re.sub(rf"^{indent}", "", content, flags=re.MULTILINE)
        content = INCLUDED.sub(lambda place: (ROOT / place[1]).read_text(encoding="utf-8").rstrip("\n"), content)
        title, mark = re.search(r'title="([^"]+)"', info), MARK.search(text, 0, fence.start())
        line = text.count("\n", 0, fence.start()) + 1
        found.append(Block(kind, title[1] if title else "", content, line, mark[1] if mark else ""))
    return found


def follow(page: Path, folder: Path) -> None:
    """Follow a page, and before it the one that it goes on from, in a folder."""
    before = AFTER.search(page.read_text(encoding="utf-8"))
    if before:
        follow((page.parent / before[1]).resolve(), folder)
    elif not (folder / MODELS).exists():  # a reader is in a checkout
        (folder / MODELS).symlink_to(ROOT / MODELS)
    names: dict[str, object] = {"__name__": "__main__"}
    with contextlib.chdir(folder):
        for block in blocks(page):
            if block.reason:
                continue
            where = f"{page.name}:{block.line}"
            if block.file:
                path = folder / block.file
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(block.text, encoding="utf-8")
            elif block.kind == "python":
                exec(compile(block.text, where, "exec"), names)
            else:
                assert block.kind in SHELLS, f"{where}: a block of {block.kind} is a file or says why not"
                for command, shown in commands(block):
                    printed = carried_out(command, where)
                    if shown:
                        check_shown(shown, printed, where)


def commands(block: Block) -> Generator[tuple[str, str]]:
    """The commands of a block, lines that go on joined, each with the output that is shown below it."""
    text = block.text.replace("\\\n", " ")
    if block.kind == "sh":
        yield from ((line, "") for line in text.splitlines() if line.strip() and not line.startswith("#"))
        return
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, shown = part.partition("\n")
        yield command, shown


def carried_out(line: str, where: str) -> str:
    """Carry out one command in this process; what it printed.

    `rx90` and `python FILE` are known, their output to a file, and a status other than 0 that a comment states.
    """
    stated = STATUS.search(line)
    command, _, to = STATUS.sub("", line).split("  #")[0].partition(" > ")
    words = [each for word in shlex.split(command) for each in sorted(glob(word)) or [word]]
    assert words[0] in ("rx90", "python"), f"{where}: {line}: which command is this?"
    status, printed = (_command if words[0] == "rx90" else _script)(words[1:])
    assert status == (int(stated[1]) if stated else 0), f"{where}: {line}: status {status}\n{printed}"
    if to:
        Path(to.strip()).write_text(printed, encoding="utf-8")
    return printed


def _command(words: list[str]) -> tuple[int, str]:
    """Status of `rx90` and what it printed, in this process: importing everything anew takes seconds."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        try:
            status = int(main(words))
        except SystemExit as error:  # options that print and end
            status = int(error.code or 0)
    return status, out.getvalue()


def _script(words: list[str]) -> tuple[int, str]:
    """Status of a script and what it printed, in a process of its own as a reader's."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False, env=environment)
    return done.returncode, done.stdout + (done.stderr if done.returncode else "")


def check_shown(shown: str, printed: str, where: str) -> None:
    """Check that a command said what a page shows, word by word but for times; `...` stands for lines left out."""
    left = _words(printed)
    for part in re.split(r"^\.\.\.$", shown, flags=re.MULTILINE):
        words = _words(part)
        assert not words or words in left, f"{where}: shown is\n{part}\nsaid is\n{printed}"
        left = left.partition(words)[2] if words else left


def _words(text: str) -> str:
    return " ".join(SECONDS.sub("_ s", text).split())
