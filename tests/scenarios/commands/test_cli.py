import contextlib
import json
import os
import re
from importlib.metadata import version

from bad_files import refused
from printed import printed

import rx90_mjcf
import scenarios.commands.catalog
import scenarios.experiments.robots
from scenarios.cli import main
from scenarios.command_line.output import page
from scenarios.command_line.process import Status
from scenarios.commands import COMMANDS, command
from scenarios.experiments.scenario_files import builtin_names, scenario_table
from scenarios.results.json_schemas import schema
from scenarios.support.texts import ENDING, FOLDER
from scenarios.support.versions import versions

IDENTIFY = ["identify", "--model", "m.urdf", "--unloaded", "a.csv", "--loaded", "b.csv", "--payload", "p.toml"]
STUDY = ["monte-carlo", "nominal", "--out", "there"]
EXCITE = ["excite", "nominal", "--out", "m.toml"]
PAYLOAD = rx90_mjcf.MJCF.with_name("payload_7025.toml")
HUGE = "1" + 23 * "0"
WRONG = [
    (["fly"], "no command 'fly'; known: list, run, view, paper, new-robot, "),
    (["rnu"], "no command 'rnu'; did you mean 'run'?"),
    (["--json"], "unrecognized arguments: --json"),
    (["run"], "required: SCENARIO"),
    (["run", "nominal", "--seed", str(2**31)], "expected a whole number from 0 to 2^31 - 1"),
    (["run", "nominal", "--seed", "1.5"], "'1.5' is not a whole number"),
    (["run", "nominal", "--seed", "1", "--seed", "2"], "--seed: given twice"),
    (["run", "nominal", "--save", ""], "expected the name of a folder"),
    (["run", "nominal", "--sav", "x"], "rx90 run: unrecognized arguments: --sav; did you mean '--save'?; see rx90 run"),
    (["run", "nominal", "-quiet"], "unrecognized arguments: -quiet; did you mean '--quiet'?"),
    (["--print-completion", "fsh"], "invalid choice: 'fsh'; did you mean 'fish'?; known: bash, zsh, "),
    ([*STUDY, "-n", "0"], "expected 1 or more"),
    ([*EXCITE, "--duration", "4.999"], "expected 5 to 600 s"),
    ([*EXCITE, "--evaluations", HUGE], "expected a whole number from 1 to 10000000"),
    ([*IDENTIFY, "--method", "ls-2012"], "invalid choice: 'ls-2012'; did you mean 'ls-2011'?"),
    ([*IDENTIFY, "--cutoff-hz", "inf"], "expected a finite number"),
    ([*IDENTIFY, "--current-delay", "soon"], "'soon' is not a number, and not auto"),
    ([*IDENTIFY, "--coupling", "0", "6"], "expected 1 or more"),
]


REFUSED = [
    (["run", "nominl"], "unknown scenario 'nominl'; did you mean 'nominal'?"),
    (["run", str(PAYLOAD)], "this is a payload file; expected a scenario"),
    (["run", "two\nlines.toml"], "lines.toml: no such file"),
    (["run", "nominal", "--save", "file/sub"], "Not a directory"),
    (["run", "nominal", "--save", "x" * 300], "File name too long"),
    ([*EXCITE[:-1], "file"], "file: rx90 excite did not write this file"),
    ([*EXCITE[:-1], "folder"], "folder: not a regular file"),
    (
        [*EXCITE, "--harmonics", "26", "--duration", "5"],
        "highest harmonic is at 5.2 Hz; the search resolves up to 5 Hz",
    ),
]
FOLDERS = (["run", "nominal", "--save", "file"], ["paper", "--out", "file"], ["report", "file"])


def test_a_wrong_command_line_is_one_line_before_anything_is_written_or_simulated(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sim.engine.Engine.advance", None)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "folder").mkdir()
    no_text = os.fsdecode(b"X\xff")
    (tmp_path / f"{no_text}.csv").write_text("t\n")
    before = sorted(tmp_path.iterdir())
    not_utf8 = r"X\xff.csv: the name is not UTF-8; rename the file or folder; see rx90"
    words = [word if word != "a.csv" else f"{no_text}.csv" for word in IDENTIFY]
    folders = [(each, "'file' is a file; expected a folder") for each in FOLDERS]
    for given, message in (*WRONG, *REFUSED, *folders, (words, not_utf8)):
        line = refused(capsys, given)
        assert message in line
        assert line.isascii()
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "file").read_text() == "mine"


def test_every_command_has_help_that_fits_the_terminal(capsys, monkeypatch):
    for columns in (40, 80):
        monkeypatch.setenv("COLUMNS", str(columns))
        for words in ([], *([name] for name in COMMANDS)):
            with contextlib.suppress(SystemExit):
                main([*words, "--help"] if words else [])
            text = capsys.readouterr().out
            assert max(map(len, text.splitlines())) <= columns
            assert not re.search(r"\w-\n", text)  # lines break at spaces
            assert not words or text.startswith(f"usage: rx90 {words[0]}")
            assert not words or callable(command(words[0]).main)


def test_text_on_a_terminal_of_hardly_a_column_is_wrapped_at_words(capsys, monkeypatch):
    for columns in ("1", "2"):
        monkeypatch.setenv("COLUMNS", columns)
        assert main([]) == 0
        assert "identify" in capsys.readouterr().out


def test_the_versions_that_results_depend_on_are_told(capsys):
    assert main(["--version"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0] == f"rx90 {version('rx90-drive-gain-testbench')}"
    assert {f"mujoco {version('mujoco-core')}", f"pin {version('pin')}", f"code {versions()['code']}"} <= set(told)


def test_what_is_listed_is_told_in_every_form(capsys):
    listed = {each["name"]: each["description"] for each in printed(capsys, "list", ["list"])["scenarios"]}
    assert list(listed) == builtin_names()
    assert listed["nominal"] == scenario_table("nominal")[0]["description"]
    for words in (["list"], ["list", "--format", "markdown"]):
        assert main(words) == 0
        lines = capsys.readouterr().out.splitlines()
        assert all(any(name in line and said in line for line in lines) for name, said in listed.items())


def test_a_schema_is_printed_as_it_is_shipped_and_all_are_named(capsys):
    assert main(["schema", "motion"]) == 0
    assert capsys.readouterr().out == (FOLDER / f"motion{ENDING}").read_text()
    assert main(["schema", "check"]) == 0
    assert json.loads(capsys.readouterr().out) == schema("check")
    assert main(["schema"]) == 0
    listed = capsys.readouterr().out
    assert {path.name.removesuffix(ENDING) for path in FOLDER.iterdir()} < {
        x.split()[0] for x in listed.split("\n") if x
    }
    assert re.search(r"^check +What `rx90 check --json` prints", listed, re.MULTILINE)


def test_colours_follow_the_terminal_unless_the_environment_says_otherwise(monkeypatch):
    for terminal, term, none, force, coloured in (
        (True, "xterm", "", "", True), (True, "dumb", "", "", False), (False, "xterm", "", "", False),
        (False, "xterm", "", "1", True), (True, "xterm", "1", "1", False),
    ):  # fmt: skip
        monkeypatch.setattr("sys.stdout.isatty", lambda terminal=terminal: terminal)
        for name, value in (("TERM", term), ("NO_COLOR", none), ("FORCE_COLOR", force)):
            monkeypatch.setenv(name, value)
        assert page().colour is coloured


def test_what_nobody_foresaw_is_one_line_with_a_status_of_its_own(monkeypatch, capsys):
    monkeypatch.delenv("RX90_TRACEBACK", raising=False)
    monkeypatch.setattr(scenarios.commands.catalog, "builtin_names", lambda: 1 / 0)
    assert main(["list"]) == Status.UNFORESEEN == 70
    output = capsys.readouterr()
    assert output.err.count("\n") == 1
    assert "ZeroDivisionError: division by zero: internal error; please report it" in output.err
    monkeypatch.setenv("RX90_TRACEBACK", "1")
    assert main(["list"]) == Status.UNFORESEEN
    assert "Traceback" in capsys.readouterr().err
