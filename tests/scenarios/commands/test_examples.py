import shlex
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import ROOT

from scenarios.cli import main, parser_of
from scenarios.commands import COMMANDS, EXAMPLES

ELSEWHERE = ("rx90 view", "exec:")
"""Examples that need a display, or a program of the reader."""


def test_each_command_has_two_examples_that_it_understands(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert Counter(line.split()[1] for line in EXAMPLES) == dict.fromkeys(COMMANDS, 2)
    for line in EXAMPLES:
        _, name, *words = shlex.split(line)
        parser_of([name]).parse_args([name, *words])
    with pytest.raises(SystemExit, match="0"):
        main(["convert", "--help"])
    shown = capsys.readouterr().out.partition("examples:\n")[2].replace("\\\n", "").splitlines()
    assert list(map(shlex.split, shown)) == [shlex.split(line) for line in EXAMPLES if " convert " in line]
    main([])
    first = capsys.readouterr().out.partition("begin with:\n")[2].partition("\n\n")[0].replace("\\\n", "").splitlines()
    assert [line.split()[1] for line in first] == ["run", "check", "identify"]


def foreign_files() -> None:
    """A log in milliseconds, degrees and milliamperes, and recordings as CSV, of the later run."""
    log, bare = (pd.read_parquet(f"later/{name}.parquet") for name in ("loaded", "unloaded"))
    log.to_csv("tool.csv", index=False)
    bare.to_csv("bare.csv", index=False)
    units = {"t": (1e3, "t"), "q": (180.0 / np.pi, "q"), "v": (1e3, "i")}
    scaled = {f"{units[name[0]][1]}{name[1:]}": units[name[0]][0] * log[name] for name in log}
    pd.DataFrame(scaled).to_csv("log.csv", index=False)


@pytest.mark.slow
def test_examples_run_one_after_the_other_in_one_folder(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "examples" / "arm.urdf", "arm.urdf")
    shutil.copy(ROOT / "rx90_mjcf" / "rx90.xml", "arm.xml")
    gains = "".join(f"[[gains]]\njoint = {j}\nestimate = 1.0\nstd = 0.0\n" for j in range(1, 7))
    Path("sheet.toml").write_text(gains)
    for line in EXAMPLES:
        if "log.csv" in line and not Path("log.csv").exists():
            foreign_files()
        if "bare.json" in line:
            capsys.readouterr()
            assert main(shlex.split("identify --model arm.xml --unloaded bare.csv --gains gains.toml --json")) == 0
            Path("bare.json").write_text(capsys.readouterr().out)
        if any(words in line for words in ELSEWHERE):
            continue
        assert main([*shlex.split(line)[1:], "--quiet"]) == 0, line
