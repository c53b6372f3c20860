"""Every command and block of tutorial, how-to and README, page by page, in the order in which a reader meets them."""

import re
import shlex
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
import yaml
from pages import DOCS, SHELLS, Block, blocks, check_shown, commands, follow
from places import ROOT

from ident.model.arm import load_arm
from scenarios.command_line.parser import OneLineParser
from scenarios.commands import COMMANDS, command
from scenarios.experiments.gains_file import read_gains
from scenarios.experiments.robots import robot

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


def test_output_that_is_shown_is_compared_word_by_word_but_for_times():
    said = "Joint 1: 0.9398\nsimulated in 3.03 s\nNote: one\nPASSED: all\n"
    check_shown("Joint  1: 0.9398\nsimulated in 0.7 s\n...\nPASSED: all\n", said, "here")
    for other in ("Joint 1: 0.9399\n", "PASSED: all\n...\nNote: one\n", "Joint 1:\n0.9398 simulated at 1 s"):
        with pytest.raises(AssertionError, match="here: shown is"):
            check_shown(other, said, "here")


FIRST = """```toml title="mine/gains.toml"
[[gains]]
joint = 1
estimate = 11.8
std = 0.06
```
"""
SECOND = """<!-- after: first.md -->
```python
from pathlib import Path
other = Path("mine/gains.toml").read_text().replace("11.8", "13.3")
```
<!-- not run: it would not end well -->
```python
raise SystemExit(3)
```
```python
Path("other.toml").write_text(other)
```
```sh
rx90 verify mine/gains.toml \\
  other.toml > told.txt  # exit status 1
rx90 verify mine/*.toml mine/gains.toml
```
"""


def test_a_page_goes_on_where_another_ends_and_leaves_out_what_is_marked(tmp_path):
    for name, text in (("first", FIRST), ("second", SECOND)):
        (tmp_path / f"{name}.md").write_text(text)
    (tmp_path / "work").mkdir()
    follow(tmp_path / "second.md", tmp_path / "work")
    assert "MOVED: joint 1 " in (tmp_path / "work" / "told.txt").read_text()


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("  # exit status 1", "", r"second\.md:13: .*status 1"),
        ("mine/*.toml", "other.toml", r"second\.md:13: .*status 1"),
        ("```sh\n", "```sh\nmake demo\n", "which command is this"),
        ("```python\nPath", "```yaml\nPath", "a block of yaml is a file or says why not"),
    ],
)
def test_a_page_that_does_not_do_what_it_says_is_noticed(old, new, complaint, tmp_path):
    assert old in SECOND
    (tmp_path / "first.md").write_text(FIRST)
    (tmp_path / "second.md").write_text(SECOND.replace(old, new))
    (tmp_path / "work").mkdir()
    with pytest.raises(AssertionError, match=complaint):
        follow(tmp_path / "second.md", tmp_path / "work")
