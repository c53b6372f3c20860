"""Every command and block of tutorial, how-to and README, page by page, in the order in which a reader meets them."""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml
from pages import DOCS, SHELLS, Block, blocks, commands, follow
from places import ROOT

from ident.model.arm import load_arm
from scenarios.command_line.parser import OneLineParser
from scenarios.commands import COMMANDS, command
from scenarios.experiments.robots import robot
from scenarios.results.gains_file import read_gains

LEARNT = [
    ROOT / "README.md",
    *sorted(DOCS.glob("tutorial/*.md")),
    *sorted(DOCS.glob("how-to/*.md")),
    DOCS / "how-to-choose.md",
    DOCS / "scaling.md",
]
QUICK = ("rx90", "logs")
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
