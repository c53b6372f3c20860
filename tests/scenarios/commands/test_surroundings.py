"""What a shell sets for other programs ends no command in an error that nobody foresaw."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import ROOT
from quick import quick_scenario

from scenarios.command_line.process import ASKED, OPENGL, foreign_packages, without_opengl
from scenarios.support.import_path import own_packages_first

OTHERS = {
    "another Python": ("pinocchio", "from .pinocchio_pywrap_default import *"),
    "too old": ("pinocchio", ""),
    "another numpy": ("numpy", "from . import _multiarray"),
}


def rx90(*words: object, **more: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "scenarios", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=os.environ | more)


@pytest.mark.parametrize("which", OTHERS)
def test_a_package_of_another_python_gives_way_to_the_one_that_is_installed(which, tmp_path):
    name, content = OTHERS[which]
    folder = tmp_path / "ros" / name
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text(content + "\n")
    path = os.pathsep.join((str(ROOT), str(folder.parent)))
    done = rx90("trajectory", quick_scenario(tmp_path), "--out", tmp_path / "motion.csv", PYTHONPATH=path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "motion.csv").exists()


def test_folders_of_the_import_path_go_behind_only_where_the_package_is_elsewhere_too(tmp_path, monkeypatch):
    for place in ("ros/pinocchio", "mine/methods", "only/coal", "site/pinocchio"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "__init__.py").touch()
    ros, mine, only, site = (str(tmp_path / name) for name in ("ros", "mine", "only", "site"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((ros, mine, "", only)))
    monkeypatch.setattr(sys, "path", ["", ros, mine, only, site])
    own_packages_first()
    assert sys.path == ["", mine, only, site, ros]
    monkeypatch.setenv("PYTHONPATH", "")
    own_packages_first()
    assert sys.path == ["", mine, only, site, ros]


def test_other_errors_and_other_folders_are_not_blamed_on_the_import_path(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.pathsep}{tmp_path / 'nowhere'}")
    (tmp_path / "pinocchio").mkdir()  # a folder without a module gives way to the package that is installed
    assert foreign_packages(ImportError("no")) is None
    (tmp_path / "pinocchio" / "__init__.py").touch()
    assert foreign_packages(ImportError("no")) is not None
    assert foreign_packages(AttributeError("module 'pinocchio' has no attribute 'x'")) is not None
    assert foreign_packages(AttributeError("'Path' object has no attribute 'x'")) is None
    assert foreign_packages(ZeroDivisionError("no")) is None


def test_what_draws_nothing_needs_no_opengl(tmp_path):
    done = rx90("run", quick_scenario(tmp_path), "--quiet", **{OPENGL: "no-such-thing"})
    assert done.returncode in (0, 1)  # so short a motion may miss a tolerance
    assert (done.stdout != "", done.stderr) == (True, "")


def test_what_draws_says_in_one_line_that_the_opengl_asked_for_is_not_there(tmp_path):
    done = rx90("view", "nominal", "--render", tmp_path / "a.png", "--quiet", **{OPENGL: "no-such-thing"})
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("rx90: MUJOCO_GL=no-such-thing: this OpenGL backend is not available")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("asked", [None, "osmesa"])
def test_the_opengl_asked_for_is_kept_for_a_process_that_draws(monkeypatch, asked):
    if asked is None:
        monkeypatch.delenv(OPENGL, raising=False)
    else:
        monkeypatch.setenv(OPENGL, asked)
    with without_opengl():
        assert os.environ[OPENGL] == "disable"
        code = "import os; from scenarios.command_line.process import with_opengl, without_opengl\n"
        code += "with without_opengl():\n  with_opengl(); "  # as a command that is started does
        code += f"print(os.environ.get('{OPENGL}'), '{ASKED}' in os.environ)"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(ROOT))
        assert done.stdout == f"{asked} False\n"
    assert os.environ.get(OPENGL) == asked
    assert ASKED not in os.environ
