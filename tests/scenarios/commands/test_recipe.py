"""`rx90 recipe`: numbers and files of the page are the scenario's, and its commands are commands."""

import re
import shlex
from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO

import pytest
from places import ROOT

from ident.diagnosis.samples.clock import SLOW, slowest_hz
from ident.observation.observation import ObserveOptions
from ident.payload.files import read_payload
from scenarios.cli import main
from scenarios.command_line.parser import OneLineParser
from scenarios.commands import COMMANDS
from scenarios.reports.recipe import SETTINGS
from scenarios.results.run_folder import short_path

pytestmark = pytest.mark.usefixtures("_computed_once")
TEXT = """extends = "field-two-weights"
[experiment]
warm_up = 43.0
pause = 17.0
[identification.observe]
cutoff_hz = 13.0
decimation_cutoff_hz = 9.0
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> str:
    folder = tmp_path_factory.mktemp("recipe")
    (folder / "cell.toml").write_text(TEXT)
    with redirect_stdout(StringIO()) as out:
        assert main(["recipe", str(folder / "cell.toml"), "--out", str(folder / "recipe.md")]) == 0
    assert "recipe.md: Recording recipe: cell" in out.getvalue()
    return (folder / "recipe.md").read_text()


def test_motions_weights_and_rates_are_those_of_the_scenario(page):
    assert "for 43 s" in page
    assert "at 52 Hz or more" in page  # four samples in a period of the higher cut-off
    assert "416 Hz" in page  # 32 cut-offs of the positions
    rows = [[word.strip() for word in line.strip("|").split("|")] for line in page.splitlines() if line.startswith("|")]
    motions = [row for row in rows if row[-1].endswith(".parquet")]
    assert [row[1] for row in motions] == ["nothing", "light", "heavy", "nothing"]
    assert [row[2] for row in motions] == ["-", "17", "17", "17"]
    weights = {row[0]: row for row in rows if row[-1].startswith("payload")}
    assert weights["light"][1].startswith("4.275")
    assert weights["heavy"][1].startswith("7.025")
    assert weights["heavy"][-1] == "payload-heavy.toml"
    assert "rated for 6 kg, everything mounted together. Above the rated load: heavy;" in page
    assert re.search(r"^Logs of these motions will exclude: zeros beyond [\d.]+ \(q2\), ", page, re.MULTILINE)
    assert "They will not determine: zero of q1;" in page


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


def test_every_command_on_the_page_can_be_given(page):
    lines = re.findall(r"^\s*(rx90 .*)$", page, re.MULTILINE)
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
    checks = [shlex.split(line) for line in lines if " check " in line]
    for words, name in zip(checks, ("light", "heavy"), strict=True):
        at = words.index("--loaded")
        assert words[3:at] == ["unloaded.parquet", "unloaded-2.parquet"]
        assert words[at:] == ["--loaded", f"{name}.parquet", "--payload", f"payload-{name}.toml"]


def test_weights_have_the_deviations_that_are_stated_on_the_page_and_in_files(tmp_path):
    light = (
        "[belief.payloads.light]\nmass = 2.4\nmass_std = 0.03\ncom = [0.1, 0.2, 0.3]\ncom_std = [0.01, 0.02, 0.04]\n"
        "[belief.payloads.heavy]\ncom_std = [0.0, 0.0, 0.0]\n"
    )
    (tmp_path / "cell.toml").write_text(TEXT + light)
    (tmp_path / "payload-heavy.toml").write_text("mine")
    for _ in range(2):  # files of payloads stay, whoever wrote them
        assert main(["recipe", str(tmp_path / "cell.toml"), "--out", str(tmp_path / "recipe.md")]) == 0
        row = "| light | 2.4 ± 0.03 | 0.1, 0.2, 0.3 ± 0.01, 0.02, 0.04 |"
        assert row in (tmp_path / "recipe.md").read_text()
        assert "| heavy | 7.025 ± 0.025 | 0, 0, 0.142776 |" in (tmp_path / "recipe.md").read_text()
    found = read_payload(tmp_path / "payload-light.toml")
    assert (found.mass_std, found.com_std) == (0.03, (0.01, 0.02, 0.04))
    assert (tmp_path / "payload-heavy.toml").read_text() == "mine"
    assert not (tmp_path / "payload.toml").exists()  # nothing of that name is mounted


def test_page_and_how_to_tell_one_story_of_settings_and_rates(page):
    guide = " ".join((ROOT / "docs" / "how-to" / "record.md").read_text().split())
    assert SETTINGS in guide
    assert f"Log at {SLOW:g} Hz or more" in guide
    assert SETTINGS in page
    assert slowest_hz(ObserveOptions(cutoff_hz=7.0, decimation_cutoff_hz=11.0)) == 44.0


def test_a_path_with_detours_is_written_without_them(tmp_path):
    near, far = tmp_path / "near", tmp_path / "far"
    near.mkdir()
    (far / "deep").mkdir(parents=True)
    for folder in (tmp_path, far, near):
        (folder / "arm.xml").write_text(folder.name)
    assert short_path(near / ".." / "arm.xml") == str(tmp_path / "arm.xml")
    (near / "linked").symlink_to(far / "deep")  # beyond a link, .. is another folder
    assert short_path(near / "linked" / ".." / "arm.xml") == str(near / "linked" / ".." / "arm.xml")


def test_a_payload_file_that_states_something_else_is_kept_and_told(tmp_path, capsys):
    (tmp_path / "cell.toml").write_text(TEXT)
    command = ["recipe", str(tmp_path / "cell.toml"), "--out", str(tmp_path / "recipe.md"), "--force"]
    assert main(command) == 0
    heavy = tmp_path / "payload-heavy.toml"
    measured = heavy.read_text().replace("7.025", "7.113")
    heavy.write_text(measured)
    capsys.readouterr()
    assert main(command) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"{heavy}: kept, but it differs from the scenario's payload" in text
    assert text.count("kept,") == 1  # the light one is as it was
    assert heavy.read_text() == measured
