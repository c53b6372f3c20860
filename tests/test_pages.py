import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Generator
from dataclasses import dataclass
from glob import glob
from pathlib import Path

import numpy as np
import pytest
import yaml
from places import ROOT

from ident.model.arm import load_arm
from scenarios.cli import OneLineParser, main
from scenarios.commands import COMMANDS, command
from scenarios.experiments.robots import robot
from scenarios.results.gains_file import read_gains

# Pages as programs: a block with a title is a file; one of `sh` or `console` is commands; one of `python` is run with
# what the blocks before it have left. A block that cannot run says why in the line before it,
# `<!-- not run: reason -->`, and a page that goes on from another one names it, `<!-- after: page.md -->`.
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
    """One block: its language, title, text with what it includes, line from 1, and why it is not run, if so."""

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


LEARNT = [
    ROOT / "README.md",
    *sorted(DOCS.glob("tutorial/*.md")),
    *sorted(DOCS.glob("how-to/*.md")),
    DOCS / "how-to-choose.md",
    DOCS / "scaling.md",
]
QUICK = ("logs",)
"""Pages that every run of the tests follows; the others take minutes together."""
UR = ("ur-log", "use-gains")
"""Pages whose end a test of their own looks at."""


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=() if page.stem in QUICK else pytest.mark.slow, id=page.stem)
        for page in LEARNT
        if page.stem not in UR and blocks(page)
    ],
)
def test_a_page_can_be_followed_to_its_end(page, tmp_path):
    follow(page, tmp_path)


@pytest.mark.slow
def test_the_pages_on_ur_logs_lead_to_the_simulated_gains_and_a_patched_model(tmp_path, monkeypatch):
    follow(DOCS / "how-to" / "use-gains.md", tmp_path)  # it goes on from the other
    monkeypatch.chdir(tmp_path)
    found, true = read_gains(Path("gains.toml")).gains, robot("ur10e").drives
    sheet = [entry.estimate for entry in read_gains(Path("sheet.toml")).gains]
    joints = ET.parse("patched.urdf").getroot()
    efforts = [float(each.get("effort")) for each in joints.findall("joint/limit")]
    for j, entry in enumerate(found):
        # Five deviations: one choice of seeds in a million misses by chance.
        assert abs(entry.estimate - true.gain[j]) < 5.0 * entry.std, entry
        np.testing.assert_allclose(efforts[j], 240.0 * entry.estimate / sheet[j], rtol=1e-5)  # six digits
    friction = [float(each.get("friction")) for each in joints.findall("joint/dynamics")]
    # Coulomb friction of a short motion with noise: what the gain says to some percent, the fit to as much.
    np.testing.assert_allclose(friction, true.coulomb_friction, rtol=0.1)
    assert len(load_arm("patched.urdf").joint_names) == 6


def words_of(block: Block) -> list[list[str]]:
    """The words of each command `rx90` of a block."""
    lines = [line.split("  #")[0].partition(" > ")[0] for line, _ in commands(block)] if block.kind in SHELLS else []
    return [shlex.split(line) for line in lines if line.startswith("rx90 ")]


def test_every_command_of_every_page_can_be_parsed_and_a_block_that_is_not_run_says_why():
    for page in (ROOT / "README.md", *sorted(DOCS.rglob("*.md"))):
        named = re.findall(r"`rx90 ([a-z][a-z-]+)[^`]*`", page.read_text(encoding="utf-8"))
        assert set(named) <= set(COMMANDS) | ({"speeds"} if page.stem == "extending" else set()), page
        for block in blocks(page) if page.stem != "extending" else ():  # its commands are there after its recipes
            assert not block.reason or re.fullmatch(r"\w+ [\w ,'./-]{8,80}", block.reason), (page, block)
            for words in words_of(block):
                if words[1] in COMMANDS:
                    parser = OneLineParser(prog="rx90")
                    command(words[1]).add_arguments(parser)
                    parser.parse_args(words[2:])


def test_every_command_is_shown_on_some_page():
    shown = {words[1] for page in LEARNT for block in blocks(page) for words in words_of(block)}
    assert {word for word in shown if word[0] != "-"} == set(COMMANDS)


def test_the_workflow_of_the_gate_runs_what_its_page_runs():
    gate = ROOT / "examples" / "ci-gate"
    steps = yaml.safe_load((gate / ".github/workflows/gains.yml").read_text())["jobs"]["gate"]["steps"]
    run = [step["run"] for step in steps if "run" in step][1:]  # the first installs
    page = [
        line for block in blocks(DOCS / "how-to" / "ci.md") if block.kind == "sh" for line in block.text.splitlines()
    ]
    assert [line.removeprefix("python -m ") for line in page[:-1]] == run
    for line in run:
        for word in line.split():
            assert "." not in word or (gate / word).exists(), word
