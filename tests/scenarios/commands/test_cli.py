"""The command line: what is refused and how, help, and what is told without any work."""

import argparse
import contextlib
import json
import os
import re
from importlib.metadata import version

import numpy as np
import pytest
from printed import fits, printed

import scenarios.commands.list
import scenarios.design.search as searching
import scenarios.experiments.named_robots
from ident.estimation.gain_options import GainOptions
from ident.observation.observation import ObserveOptions
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.command_line.process import MEANINGS, Status
from scenarios.commands import COMMANDS, GROUPS, command
from scenarios.experiments.files.attribute_docs import attribute_docs
from scenarios.experiments.files.motions import read_motion
from scenarios.experiments.files.tables import builtin_names, scenario_table
from scenarios.experiments.files.toml_text import ENDING, FOLDER
from scenarios.support.versions import versions

IDENTIFY = ["identify", "--model", "m.urdf", "--unloaded", "a.csv", "--loaded", "b.csv", "--payload", "p.toml"]
STUDY = ["monte-carlo", "nominal", "--out", "there"]
BUDGET = ["sensitivity", "nominal", "--out", "there"]
EXCITE = ["excite", "nominal", "--out", "m.toml"]
HUGE = "1" + 23 * "0"
WRONG = [
    (
        ["fly"],
        "no command 'fly'; known: list, run, view, paper, new-robot, ",
    ),
    (["rnu"], "no command 'rnu'; did you mean 'run'?"),
    (["montecarlo"], "did you mean 'monte-carlo'?"),
    (["x" * 500], "no command 'xxxxxxxx"),
    (["--json"], "unrecognized arguments: --json"),
    (["--help-me"], "--help-me"),
    (["list", "more"], "unrecognized arguments: more"),
    (["list", "two\nlines"], "unrecognized arguments: two\\nlines"),
    (["run"], "required: SCENARIO"),
    (["run", "nominal", "--seed"], "--seed: expected one argument"),
    (["run", "nominal", "--seed", "-1"], "expected a whole number from 0 to 2^31 - 1"),
    (["run", "nominal", "--seed", str(2**31)], "expected a whole number from 0 to 2^31 - 1"),
    (["run", "nominal", "--seed", HUGE], "expected a whole number from 0 to 2^31 - 1"),
    (["run", "nominal", "--seed", "9" * 5000], "is not a whole number"),
    (["run", "nominal", "--seed", "1.5"], "'1.5' is not a whole number"),
    (["run", "nominal", "--seed", "1", "--seed", "2"], "--seed: given twice"),
    (["run", "nominal", "--seed", "0", "--seed", "0"], "--seed: given twice"),
    (["run", "nominal", "--json", "--json"], "--json: given twice"),
    (["run", "nominal", "--json", "--format", "text"], "not allowed with argument"),
    (["run", "nominal", "--format", "pdf"], "invalid choice: 'pdf'"),
    (["run", "nominal", "--save", ""], "expected the name of a folder"),
    (["run", "nominal", "--sav", "x"], "rx90 run: unrecognized arguments: --sav; did you mean '--save'?; see rx90 run"),
    (["identify", "--metod=nls"], "unrecognized arguments: --metod=nls; did you mean '--method'?"),
    (["run", "nominal", "-quiet"], "unrecognized arguments: -quiet; did you mean '--quiet'?"),
    (["--versoin"], "unrecognized arguments: --versoin; did you mean '--version'?"),
    (["schema", "reslt"], "invalid choice: 'reslt'; did you mean 'result'?"),
    (["completion", "fsh"], "invalid choice: 'fsh'; did you mean 'fish'?; known: bash, zsh, fish;"),
    ([*STUDY], "required: -n"),
    ([*STUDY, "-n", "0"], "expected 1 or more"),
    ([*STUDY, "-n", "10**23"], "'10**23' is not a whole number"),
    ([*STUDY, "-n", "1", "-n", "2"], "given twice"),
    ([*STUDY, "-n", "1", "--out", "elsewhere"], "--out: given twice"),
    ([*STUDY, "-n", "1", "--jobs", "1", "--dask", "tcp://127.0.0.1:1"], "not allowed with argument"),
    ([*BUDGET, "--repeats", "none"], "'none' is not a whole number"),
    ([*BUDGET, "--samples", "-4"], "expected 1 or more"),
    ([*EXCITE, "--harmonics", "1"], "expected a whole number from 2 to 100"),
    ([*EXCITE, "--harmonics", "1000000"], "expected a whole number from 2 to 100"),
    ([*EXCITE, "--duration", "1e9"], "expected 5 to 600 s"),
    ([*EXCITE, "--duration", "4.999"], "expected 5 to 600 s"),
    ([*EXCITE, "--duration", "nan"], "expected a finite number"),
    ([*EXCITE, "--duration", "long"], "'long' is not a number"),
    ([*EXCITE, "--evaluations", HUGE], "expected a whole number from 1 to 10000000"),
    ([*EXCITE, "--evaluations", "0"], "expected a whole number from 1 to 10000000"),
    (["excite", "nominal"], "required: --out"),
    (["identify"], "required: --model"),
    ([*IDENTIFY, "--method", "best"], "invalid choice: 'best'; known: iv, ls-2011, "),
    ([*IDENTIFY, "--method", "ls-2012"], "invalid choice: 'ls-2012'; did you mean 'ls-2011'?"),
    ([*IDENTIFY, "--cutoff-hz", "inf"], "expected a finite number"),
    ([*IDENTIFY, "--cutoff-hz", "-1"], "expected a number of 0 or more"),
    ([*IDENTIFY, "--cutoff-hz", "1e999"], "expected a finite number"),
    ([*IDENTIFY, "--cutoff-hz", "auto"], "'auto' is not a number"),
    ([*IDENTIFY, "--current-delay", "soon"], "'soon' is not a number, and not auto"),
    ([*IDENTIFY, "--coupling", "5"], "expected 2 arguments"),
    ([*IDENTIFY, "--coupling", "0", "6"], "expected 1 or more"),
    (["paper", "--out", ""], "expected the name of a folder"),
    (["paper", "--seed", "x"], "'x' is not a whole number"),
    (["scoreboard", "there", "--out", "page", "--time-limit", "0.09"], "expected 0.1 to 86400 s: "),
]


@pytest.mark.parametrize(("words", "message"), WRONG, ids=lambda value: None)
def test_a_wrong_command_line_is_one_line_and_exit_status_2(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as caught:
        main(words)
    output = capsys.readouterr()
    assert caught.value.code == Status.BAD_INPUT
    assert output.out == ""
    assert output.err.startswith("rx90")
    assert message in output.err
    assert output.err.count("\n") == 1
    assert len(output.err) < 700
    assert not list(tmp_path.iterdir())


NO_TEXT = [
    ["identify", "--model", "m.urdf", "--unloaded", "X.csv", "--loaded", "b.csv", "--payload", "p.toml"],
    ["identify", "--model", "X.xml", "--unloaded", "a.csv", "--loaded", "b.csv", "--payload", "p.toml"],
    [*IDENTIFY, "--save", "X"],
    [*IDENTIFY, "--gains-out=X.toml"],
    ["check", "X.csv", "--robot", "rx90"],
    ["convert", "X.csv", "--out", "c.csv"],
    ["convert", "a.csv", "--out", "X.csv"],
    ["run", "X.toml"],
    ["run", "nominal", "--save", "X"],
    ["monte-carlo", "nominal", "--out", "X"],
    ["new-robot", "X.xml", "--out", "there"],
]


@pytest.mark.parametrize("words", NO_TEXT, ids=" ".join)
def test_a_name_that_is_no_text_is_refused_in_one_line_that_can_be_printed(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for each in (b"X\xff.csv", b"X\xff.toml"):
        (tmp_path / os.fsdecode(each)).write_text("t\n")
    with pytest.raises(SystemExit) as caught:
        main([word.replace("X", os.fsdecode(b"X\xff")) for word in words])
    output = capsys.readouterr()
    assert (caught.value.code, output.out) == (Status.BAD_INPUT, "")
    assert "X\\xff" in output.err
    assert "the name is not UTF-8; rename the file or folder; see rx90" in output.err
    assert output.err.isascii()
    assert output.err.count("\n") == 1


REFUSED = [
    (["run", "nominl"], "unknown scenario 'nominl'; did you mean 'nominal'?"),
    (["run", "there.toml"], "there.toml: no such file"),
    (["run", "two\nlines.toml"], "lines.toml: no such file"),
    (["run", "nominal", "--save", "file/sub"], "Not a directory"),
    (["run", "nominal", "--save", "x" * 300], "File name too long"),
    ([*EXCITE[:-1], "file"], "file: rx90 excite did not write this file"),
    ([*EXCITE[:-1], "folder"], "folder: not a regular file"),
    ([*EXCITE[:-1], "/dev/full"], "/dev/full: not a regular file"),
    (
        [*EXCITE, "--harmonics", "26", "--duration", "5"],
        "highest harmonic is at 5.2 Hz; the search resolves up to 5 Hz",
    ),
]


@pytest.mark.parametrize("words", [["run", "nominal", "--save"], ["paper", "--out"], ["report"]], ids=" ".join)
def test_a_file_where_a_folder_is_expected_is_one_line(words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(SystemExit) as ended:
        main([*words, "file"])
    said = capsys.readouterr().err
    assert (ended.value.code, said.count("\n")) == (2, 1)
    assert "'file' is a file; expected a folder" in said
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize(("words", "message"), REFUSED, ids=lambda value: None)
def test_what_cannot_be_is_found_before_anything_is_simulated(words, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sim.engine.Engine.advance", None)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    assert main(words) == Status.BAD_INPUT
    output = capsys.readouterr()
    assert output.out == ""
    assert message in output.err
    assert output.err.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"file", "folder"}
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize("words", [[], ["--help"]])
def test_without_a_command_one_is_told_what_one_can_do_in_order_of_use(words, capsys):
    with contextlib.suppress(SystemExit):
        assert main(words) == 0
    text = capsys.readouterr().out
    expected = [entry for title, group in GROUPS.items() for entry in (f"{title}:", *(f"  {name} " for name in group))]
    places = [re.search(f"^{entry}", text, re.MULTILINE).start() for entry in expected]
    assert places == sorted(places)


def test_help_tells_every_status(capsys):
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["--help"])
    text = capsys.readouterr().out
    for status, meaning in MEANINGS.items():
        assert f"{status:d}" in text
        assert meaning in " ".join(text.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_that_describes_each_option(name, capsys):
    with pytest.raises(SystemExit) as caught:
        main([name, "--help"])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    assert f"usage: rx90 {name}" in text
    assert callable(command(name).main)


def test_options_are_described_by_the_class_they_belong_to():
    docs = attribute_docs(ObserveOptions)
    assert docs["cutoff_hz"] == "Low-pass of the positions before differentiation [Hz]"
    assert docs["current_delay"].endswith("if half a period is negligible")
    for kind in (ObserveOptions, GainOptions):
        assert set(attribute_docs(kind)) == set(kind.__dataclass_fields__)


def test_the_versions_that_results_depend_on_are_told(capsys):
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["--version"])
    told = capsys.readouterr().out.splitlines()
    assert told[0] == f"rx90 {version('rx90-drive-gain-testbench')}"
    assert {f"mujoco {version('mujoco-core')}", f"pin {version('pin')}", f"code {versions()['code']}"} <= set(told)


def test_what_is_listed_is_told_in_every_form(capsys):
    assert main(["list", "--json"]) == 0
    listed = {each["name"]: each["description"] for each in printed(capsys, "list")["scenarios"]}
    assert list(listed) == builtin_names()
    assert listed["nominal"] == scenario_table("nominal")[0]["description"]
    for words in (["list"], ["list", "--format", "markdown"]):
        assert main(words) == 0
        lines = capsys.readouterr().out.splitlines()
        assert all(any(name in line and said in line for line in lines) for name, said in listed.items())


def test_a_schema_is_printed_as_it_is_shipped_and_all_are_named(capsys):
    assert main(["schema", "check"]) == 0
    assert capsys.readouterr().out == (FOLDER / f"check{ENDING}").read_text()
    assert main(["schema", "--json"]) == 0
    named = json.loads(capsys.readouterr().out)
    assert {name: each["file"] for name, each in named.items()} == {
        path.name.removesuffix(ENDING): str(path) for path in FOLDER.iterdir()
    }
    assert "rx90 check --json" in named["check"]["about"]


def test_couplings_are_counted_from_one_on_the_command_line(monkeypatch, capsys, tmp_path):
    asked = []

    def read(path, couplings, flange):
        asked.append(couplings)
        raise RobotModelError("seen")

    monkeypatch.setattr(scenarios.experiments.named_robots, "read_arm", read)
    for name in ("arm.xml", "a.csv", "b.csv", "p.toml"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    words = ["identify", "--model", "arm.xml", "--unloaded", "a.csv", "--loaded", "b.csv", "--payload", "p.toml"]
    assert main([*words, "--coupling", "5", "6", "--coupling", "2", "4"]) == Status.BAD_INPUT
    assert capsys.readouterr().err == "rx90: seen\n"
    assert asked == [((4, 5), (1, 3))]


def test_a_budget_has_64_rows_of_its_design_unless_told():
    parser = argparse.ArgumentParser()
    command("sensitivity").add_arguments(parser)
    assert parser.parse_args(["nominal", "--out", "there"]).samples == 64


def test_what_nobody_foresaw_is_one_line_with_a_status_of_its_own(monkeypatch, capsys):
    monkeypatch.delenv("RX90_TRACEBACK", raising=False)
    monkeypatch.setattr(scenarios.commands.list, "builtin_names", lambda: 1 / 0)
    assert main(["list"]) == Status.UNFORESEEN == 70
    output = capsys.readouterr()
    assert output.err.count("\n") == 1
    assert "ZeroDivisionError: division by zero: internal error; please report it" in output.err
    monkeypatch.setenv("RX90_TRACEBACK", "1")
    assert main(["list"]) == Status.UNFORESEEN
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize("columns", [40, 80])
@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_the_terminal(columns, name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert main([]) == 0
    with pytest.raises(SystemExit, match=r"^0$"):
        main([name, "--help"])
    assert max(map(len, capsys.readouterr().out.splitlines())) <= columns


@pytest.mark.parametrize(
    ("columns", "usage"), [(59, "usage: rx90 run SCENARIO ..."), (60, "usage: rx90 run [-h] [--seed SEED]")]
)
def test_usage_on_a_narrow_terminal_names_what_must_be_given(columns, usage, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["run", "--help"])
    assert capsys.readouterr().out.splitlines()[0].startswith(usage)


def test_a_motion_that_is_searched_beats_its_start_and_is_written_once(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(searching, "FIRST", 30)
    words = ["excite", "nominal", "--out", str(tmp_path / "m.toml"), "--harmonics", "4", "--duration", "8"]
    assert main([*words, "--evaluations", "40", "--seed", "3", "--json"]) == 0
    output = capsys.readouterr()
    document = json.loads(output.out)
    fits(document, "excite")
    (costs,) = (each.replace(",", "").split() for each in output.err.splitlines() if "cost of the start" in each)
    start, found = (float(costs[costs.index(word) + 1]) for word in ("start", "found"))
    assert found <= start
    np.testing.assert_allclose([document["cost_of_start"], document["cost"]], [start, found], atol=1e-4)  # as printed
    predicted = ", ".join(f"{100.0 * share:.2g}" for share in document["predicted_rel_std"][:5])
    assert f"joints 1 to 6: {predicted}" in (tmp_path / "m.toml").read_text()
    text = (tmp_path / "m.toml").read_text()
    assert "# Found by: rx90 excite nominal --seed 3 --harmonics 4 --duration 8 --evaluations 40 --out FILE" in text
    assert read_motion("m.toml", tmp_path).sine.shape == (6, 4)
