"""Without what only some commands need: the others work, and these say in one line what installs it."""

import re
import shutil
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
from foreign_logs import csv
from one_process import Outcome, carried_out
from places import ROOT
from quick import quick_scenario

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.support.extras import EXTRAS, PROJECT, needed_extra

BLOCKED = """
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
"""
NAMES = {
    "vl_convert": "vl-convert-python",
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


def light(folder: Path, commands: dict[str, list[object]], there: set[str] = frozenset()) -> dict[str, Outcome]:
    """Commands where, of the packages of extras, only some are there."""
    words = [["rx90", *map(str, each)] for each in commands.values()]
    found = carried_out(words, folder, before=BLOCKED.format(names=set(EXTRAS) - there))
    return dict(zip(commands, found, strict=True))


@pytest.fixture(scope="module")
def cell(weighed_cell, tmp_path_factory) -> Path:
    """Recordings as CSV, a scenario, and the payload."""
    folder = tmp_path_factory.mktemp("light")
    for name in ("unloaded", "heavy", "light"):
        write_recording(read_recording(weighed_cell / "run" / f"{name}.parquet"), folder / f"{name}.csv")
    for name in ("heavy", "light"):
        (folder / f"{name}.toml").write_text((weighed_cell / "run" / f"payload-{name}.toml").read_text())
    quick_scenario(folder, method="nls")
    shutil.copytree(weighed_cell / "run", folder / "made")
    return folder


MODEL = ["--model", rx90_mjcf.MJCF, "--unloaded", "unloaded.csv"]
LOADED = [*MODEL, "--loaded", "heavy.csv", "--payload", "heavy.toml", "--option", "friction=viscous-coulomb"]
CORE = {
    "run": ["run", "quick.toml", "--gains-out", "run.toml"],
    "identify": ["identify", *LOADED, "--unseen", "light.csv", "--unseen-payload", "light.toml"],
    "check": ["check", rx90_mjcf.MJCF, "unloaded.csv", "--loaded", "heavy.csv", "--payload", "heavy.toml"],
    "convert": ["convert", "unloaded.csv", "--out", "again.csv"],
    "list": ["list"],
    "schema": ["schema", "result"],
    "version": ["--version"],
}


@pytest.fixture(scope="module")
def core(cell) -> dict[str, Outcome]:
    return light(cell, CORE)


@pytest.mark.parametrize("name", CORE)
def test_the_core_needs_no_extra(core, name):
    assert core[name].status == 0, core[name].err
    assert core[name].out


REFUSED = {
    "a Parquet log": (["identify", *MODEL[:3], "heavy.parquet"], "parquet"),
    "run --save": (["run", "quick.toml", "--save", "saved"], "parquet"),
    "monte-carlo": (["monte-carlo", "quick.toml", "-n", "2", "--out", "study"], "study"),
    "excite": (["excite", "nominal", "--out", "motion.toml"], "study"),
    "a bag": (["convert", "log.mcap", "--out", "log.csv", "--signal", "current"], "ros"),
    "report": (["report", "made"], "pages"),
}


@pytest.fixture(scope="module")
def refused(cell) -> dict[str, Outcome]:
    for name in ("heavy.parquet", "log.mcap"):
        (cell / name).write_bytes(b"PAR1")
    before = sorted(path.name for path in cell.iterdir())
    found = light(cell, {what: words for what, (words, _) in REFUSED.items()})
    assert sorted(path.name for path in cell.iterdir()) == before
    return found


@pytest.mark.parametrize("what", REFUSED)
def test_an_extra_that_is_missing_is_one_line_with_the_command_that_installs_it(refused, what):
    done, (_, extra) = refused[what], REFUSED[what]
    assert done.status == 2
    assert done.out == ""
    assert f"pip install '{PROJECT}[" in done.err.splitlines()[-1]
    assert f"[{extra}]'" in done.err.splitlines()[-1]
    assert "Traceback" not in done.err


ENOUGH = {
    "pages": ["report", "made"],
    "study": ["monte-carlo", "quick.toml", "-n", "2", "--jobs", "1", "--out", "study"],
    "film": ["view", "quick.toml", "--render", "arm.png"],
}


@pytest.mark.parametrize("extra", ENOUGH)
def test_a_command_works_with_the_packages_of_its_extra_alone(cell, extra):
    # Where OpenGL's libraries are missing, its Python package is nevertheless found.
    done = light(cell, {extra: ENOUGH[extra]}, there=brought(extra))[extra]
    assert done.status == 0 or "no OpenGL for rendering" in done.err, done.err


def test_every_extra_that_is_named_brings_its_package():
    assert PROJECT_TABLE["name"] == PROJECT
    core = " ".join(PROJECT_TABLE["dependencies"])
    for package, (extra, _) in EXTRAS.items():
        assert package in brought(extra)
        assert NAMES.get(package, package) not in core
    assert needed_extra("numpy.linalg") is None


def test_numbers_dates_and_faults_of_a_csv_are_read_alike_without_pyarrow(tmp_path, monkeypatch):
    t = 0.004 * np.arange(50)
    columns = {"t": t, "q1": np.sin(3.0 * t), "v1": 1e-7 * np.cos(5.0 * t) - 2.5}
    whole = csv(tmp_path / "log.csv", columns)
    lines = ["t;q1;v1", *(f"{1.5 + 0.01 * k:.2f};+{0.1 * k * k:.3f};-1,5e-3".replace(".", ",") for k in range(9))]
    (tmp_path / "comma.csv").write_text("\n".join(["# a comment", *lines, ""]).replace("-1,5e-3;", ""))
    with_arrow = [read_columns(path) for path in (whole, tmp_path / "comma.csv")]
    (tmp_path / "ragged.csv").write_text("t,q1,v1\n0.0,1.0,2.0\n0.1,1.0\n")
    (tmp_path / "word.csv").write_text("t,q1,v1\n0.0,1.0,2.0\n0.1,1.x,3.0\n")
    (tmp_path / "dated.csv").write_text(
        "time,q1,v1\n2031-07-19T09:41:07.125,1.0,2.0\n2031-07-19T09:41:07.625+00:00,1.1,2.2\n2031-07-19,1.3,2.3\n"
    )
    faults = [fault(tmp_path / name) for name in ("ragged.csv", "word.csv")]
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for one, other in zip(with_arrow, map(read_columns, (whole, tmp_path / "comma.csv")), strict=True):
        for name, values in one.items():
            np.testing.assert_array_equal(other[name], values)
    assert [fault(tmp_path / name) for name in ("ragged.csv", "word.csv")] == faults
    monkeypatch.setenv("TZ", "JST-9")  # dates without an offset are none of this clock's
    time.tzset()
    dated = read_columns(tmp_path / "dated.csv", ("time", "q1", "v1"), {"time"})["time"]
    monkeypatch.undo()
    time.tzset()
    np.testing.assert_allclose(np.diff(dated), [0.5, -9 * 3600.0 - 41 * 60.0 - 7.625], atol=1e-6)


def read_columns(path: Path, names: tuple[str, ...] = ("t", "q1", "v1"), dated: set[str] = frozenset()) -> dict:
    from ident.recordings.formats.columns import Chosen, Request
    from ident.recordings.formats.csv import read_csv

    request = Request(
        chosen=lambda path, header: Chosen(names, frozenset(dated)), known=lambda words: len(set(words) & set(names))
    )
    return dict(read_csv(path, request))


def fault(path: Path) -> str:
    with pytest.raises(ValueError, match=path.name) as caught:
        read_columns(path)
    return str(caught.value)
