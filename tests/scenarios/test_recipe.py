"""`rx90 recipe`: numbers and files of the page are the scenario's, and its commands are commands."""

import re
import shlex
from importlib import import_module

from scenarios.cli import main
from scenarios.commands import COMMANDS
from scenarios.commands.parser import OneLineParser

TEXT = """extends = "field-two-weights"
[experiment]
warm_up = 43.0
pause = 17.0
[identification.observe]
cutoff_hz = 13.0
decimation_cutoff_hz = 9.0
"""


def page(tmp_path) -> str:
    (tmp_path / "cell.toml").write_text(TEXT)
    assert main(["recipe", str(tmp_path / "cell.toml"), "--out", str(tmp_path / "recipe.md")]) == 0
    return (tmp_path / "recipe.md").read_text()


def test_motions_weights_and_rates_are_those_of_the_scenario(tmp_path, capsys):
    text = page(tmp_path)
    assert "for 43 s" in text
    assert "more than 26 Hz" in text  # twice the higher cut-off
    assert "416 Hz" in text  # 32 cut-offs of the positions
    rows = [[word.strip() for word in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    motions = [row for row in rows if row[-1].endswith(".parquet")]
    assert [row[1] for row in motions] == ["nothing", "light", "heavy", "nothing"]
    assert [row[2] for row in motions] == ["-", "17", "17", "17"]
    weights = {row[0]: row for row in rows if row[-1].startswith("payload")}
    assert weights["light"][1].startswith("4.275")
    assert weights["heavy"][1].startswith("7.025")
    assert weights["heavy"][-1] == "payload-heavy.toml"
    assert "rated for 6 kg, everything mounted together. Beyond that: heavy;" in text
    assert "recipe.md: Recording recipe: cell" in capsys.readouterr().out


def test_commands_know_the_flange_and_the_couplings_that_are_believed(tmp_path):
    (tmp_path / "cell.toml").write_text('extends = "tx40"\n[belief]\ncouplings = [[5, 6], [1, 3]]\n')
    assert main(["recipe", str(tmp_path / "cell.toml"), "--out", str(tmp_path / "recipe.md")]) == 0
    lines = re.findall(r"^\s*(rx90 .*)$", (tmp_path / "recipe.md").read_text(), re.MULTILINE)
    believing = [line for line in lines if shlex.split(line)[1] in {"check", "identify", "verify"}]
    assert len(believing) == 3
    for line in believing:
        assert "--coupling 5 6 --coupling 1 3" in line
        words = shlex.split(line)
        parser = OneLineParser(prog="rx90")
        import_module(f"scenarios.commands.{words[1]}").add_arguments(parser)
        parser.parse_args(words[2:])


def test_every_command_on_the_page_can_be_given(tmp_path):
    lines = re.findall(r"^\s*(rx90 .*)$", page(tmp_path), re.MULTILINE)
    named = [shlex.split(line)[1] for line in lines]
    assert {"trajectory", "view", "convert", "identify", "verify"} <= set(named) <= set(COMMANDS)
    for line in lines:
        words = shlex.split(line)
        parser = OneLineParser(prog="rx90")
        import_module(f"scenarios.commands.{words[1]}").add_arguments(parser)
        parser.parse_args(words[2:])
    identify = next(line for line in lines if " identify " in line)
    assert "--unloaded unloaded.parquet --loaded light.parquet --payload payload-light.toml" in identify
    assert "--cutoff-hz 13.0" in identify
