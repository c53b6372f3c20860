import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from one_process import Outcome, carried_out
from places import ROOT
from quick import BRIEF, quick_scenario

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.support.naming import EXTRAS, PROJECT, needed_extra

BLOCKED = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
"""
NAMES = {
    "PIL": "pillow",
    "imageio_ffmpeg": "imageio[ffmpeg]",
    "OpenGL": "mujoco-core[rendering]",
    "glfw": "mujoco-core[rendering]",
}
"""Of distributions, where the name that is imported is another."""
PROJECT_TABLE = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def brought(extra: str) -> set[str]:
    """Import names of the packages that an extra installs."""
    needed = list(PROJECT_TABLE["optional-dependencies"][extra])
    for each in needed:
        if found := re.fullmatch(rf"{PROJECT}\[(.*)\]", each):
            needed += [name for more in found[1].split(",") for name in PROJECT_TABLE["optional-dependencies"][more]]
    found = {package for package in EXTRAS if any(each.startswith(NAMES.get(package, package)) for each in needed)}
    return found | {"PIL"} if "matplotlib" in found else found  # which depends on it


@pytest.fixture(scope="module")
def cell(weighed_cell, tmp_path_factory) -> Path:
    """Recordings as CSV, a scenario, and the payload."""
    folder = tmp_path_factory.mktemp("light")
    for name in ("unloaded", "heavy", "light"):
        log, part = read_recording(weighed_cell / "run" / f"{name}.parquet"), slice(0, 4500, 4)
        write_recording(replace(log, t=log.t[part], q=log.q[part], v=log.v[part]), folder / f"{name}.csv")
    for name in ("heavy", "light"):
        (folder / f"{name}.toml").write_text((weighed_cell / "run" / f"payload-{name}.toml").read_text())
    quick_scenario(folder, 'options = { friction = "viscous-coulomb" }', method="nls", lasts=BRIEF)
    shutil.copytree(weighed_cell / "run", folder / "made")
    return folder


MODEL = ["--model", rx90_mjcf.MJCF, "--unloaded", "unloaded.csv"]
LOADED = [*MODEL, "--loaded", "heavy.csv", "--payload", "heavy.toml", "--method", "ls-2011"]
CORE = {
    "run": ["run", "quick.toml", "--gains-out", "run.toml"],
    "identify": ["identify", *LOADED, "--unseen", "light.csv", "--unseen-payload", "light.toml"],
    "check": ["check", rx90_mjcf.MJCF, "unloaded.csv"],
    "convert": ["convert", "unloaded.csv", "--out", "again.csv"],
    "list": ["list"],
    "schema": ["schema", "result"],
    "version": ["--version"],
}


REFUSED = {
    "a Parquet log": (["identify", *MODEL[:3], "heavy.parquet"], "parquet"),
    "run --save": (["run", "quick.toml", "--save", "saved"], "parquet"),
    "monte-carlo": (["monte-carlo", "quick.toml", "-n", "2", "--out", "study"], "study"),
    "excite": (["excite", "nominal", "--out", "motion.toml"], "study"),
    "a bag": (["convert", "log.mcap", "--out", "log.csv", "--signal", "current"], "ros"),
    "report": (["report", "made"], "pages"),
}


@pytest.fixture(scope="module")
def outcomes(cell) -> dict[str, Outcome]:
    """What becomes of all commands where no package of an extra is there."""
    for name in ("heavy.parquet", "log.mcap"):
        (cell / name).write_bytes(b"PAR1")
    commands = CORE | {what: words for what, (words, _) in REFUSED.items()}
    words = [["rx90", *map(str, each)] for each in commands.values()]
    return dict(zip(commands, carried_out(words, cell, before=BLOCKED.format(names=set(EXTRAS))), strict=True))


@pytest.mark.parametrize("name", CORE)
def test_the_core_needs_no_extra(outcomes, name):
    assert outcomes[name].status == 0, outcomes[name].err
    assert outcomes[name].out


@pytest.mark.parametrize("what", REFUSED)
def test_an_extra_that_is_missing_is_one_line_with_the_command_that_installs_it(outcomes, cell, what):
    done, (words, extra) = outcomes[what], REFUSED[what]
    assert (done.status, done.out) == (2, "")
    assert re.search(rf"pip install '{PROJECT}\[.*\b{extra}\]'", done.err.splitlines()[-1])
    assert "Traceback" not in done.err
    for option in {"--out", "--save"} & set(words):
        assert not (cell / words[words.index(option) + 1]).exists()


def test_every_extra_that_is_named_brings_its_package():
    assert PROJECT_TABLE["name"] == PROJECT
    core = " ".join(PROJECT_TABLE["dependencies"])
    for package, (extra, _) in EXTRAS.items():
        assert package in brought(extra)
        assert NAMES.get(package, package) not in core
    assert needed_extra("numpy.linalg") is None
