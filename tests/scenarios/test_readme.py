import re
import shlex

import pytest
from places import ROOT

import rx90_mjcf
from scenarios.cli import main
from scenarios.commands import COMMANDS
from scenarios.commands.parser import OneLineParser
from scenarios.commands.status import MEANINGS

README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
SHOWN = re.findall(r"^    (?:\$ )?rx90 .*$", README, re.MULTILINE)
LINES = [line.split("#")[0].strip().removeprefix("$ ") for line in SHOWN]


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A folder as a user has it: two logs, a payload, a model, and a scenario."""
    folder = tmp_path_factory.mktemp("readme")
    main(["run", "nominal", "--save", str(folder), "--json"])
    (folder / "unloaded.parquet").rename(folder / "bare.parquet")
    (folder / "loaded.parquet").rename(folder / "heavy.parquet")
    (folder / "our-cell.toml").write_text('extends = "nominal"\n')
    return folder


def test_the_table_that_is_shown_is_what_the_command_prints(capsys):
    assert main(["run", "nominal"]) == 0
    printed = capsys.readouterr().out
    shown = README.partition("    $ make demo\n")[2].partition("\n\n")[0]
    timing = re.compile(r"simulated in .*")
    words = [timing.sub("", text).split() for text in (shown, printed)]
    assert words[0] == words[1]


@pytest.mark.parametrize("number", range(len(BLOCKS)))
def test_every_python_block_runs(number, saved, monkeypatch):
    monkeypatch.chdir(saved)
    code = BLOCKS[number].replace('load_arm("arm.urdf")', f"load_arm({str(rx90_mjcf.MJCF)!r})")
    exec(compile(code, "README.md", "exec"), {})


@pytest.mark.parametrize("line", LINES)
def test_every_command_line_can_be_parsed(line):
    from importlib import import_module

    words = shlex.split(line)
    parser = OneLineParser(prog="rx90")
    import_module(f"scenarios.commands.{words[1].replace('-', '_')}").add_arguments(parser)
    parser.parse_args(words[2:])


def test_every_command_and_status_is_in_the_readme():
    assert {shlex.split(line)[1] for line in LINES} == set(COMMANDS)
    for status in MEANINGS:
        assert re.search(rf"^\|.*\b{status:d}\b.*\|$", README, re.MULTILINE)
