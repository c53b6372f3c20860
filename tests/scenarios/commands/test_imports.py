"""A command imports what it needs: a second of imports is more than the work of most."""

import subprocess
import sys

import pytest
from quick import quick_scenario

import rx90_mjcf

ASKED = """
import sys
from scenarios.__main__ import main
sys.argv[0] = "rx90"
try:
    main()
finally:
    print(*sys.modules, file=sys.stderr)
"""
SLOW = {
    "pandas",
    "matplotlib",
    "altair",
    "jinja2",
    "glfw",
    "pyarrow.compute",
    "urllib.request",
    *(f"scipy.{name}" for name in ("signal", "stats", "interpolate", "ndimage", "optimize", "special", "spatial")),
}
"""What reads no Parquet, filters no recording and identifies no gain."""


def imported(*words: object) -> set[str]:
    done = subprocess.run([sys.executable, "-c", ASKED, *map(str, words)], capture_output=True, text=True, check=True)
    return set(done.stderr.split())


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder = tmp_path_factory.mktemp("imports")
    scenario = quick_scenario(folder)
    modules = imported("run", scenario, "--save", folder / "cell")
    return folder / "cell", modules


def test_to_run_a_scenario_imports_nothing_slow(cell):
    _, modules = cell
    assert "mujoco" in modules
    assert not modules & SLOW


@pytest.mark.parametrize("form", ["text", "json"])
def test_to_identify_gains_by_any_model_imports_nothing_slow(cell, form):
    folder, _ = cell
    modules = imported(
        "identify", "--model", rx90_mjcf.MJCF, "--unloaded", folder / "unloaded.parquet", "--loaded",
        folder / "loaded.parquet", "--payload", folder / "payload.toml", "--format", form,
    )  # fmt: skip
    assert "ident.estimation.all_joints.search" in modules
    assert not modules & SLOW
    assert "rich.progress" not in modules


def test_to_check_logs_imports_nothing_slow(cell):
    folder, _ = cell
    pair = folder / "unloaded.parquet", "--loaded", folder / "loaded.parquet", "--payload", folder / "payload.toml"
    modules = imported("check", "rx90", *pair)
    assert "ident.diagnosis.engine" in modules
    assert not modules & SLOW


def test_help_of_a_command_imports_no_simulator_and_no_other_command():
    modules = imported("check", "--help")
    assert "scenarios.commands.check" in modules
    assert not modules & (SLOW | {"mujoco", "pinocchio", "pydantic", "rich", "pyarrow", "scenarios.commands.identify"})
