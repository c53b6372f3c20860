"""A command imports what it needs: a second of imports is more than the work of most."""

import subprocess
import sys

import pytest
from one_process import carried_out
from quick import quick_scenario

import rx90_mjcf
from scenarios.cli import main

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


@pytest.fixture(scope="module")
def imported(tmp_path_factory) -> dict[str, frozenset[str]]:
    """What is imported when each command has ended, one after the other in one process, the simulator last."""
    folder = tmp_path_factory.mktemp("imports")
    scenario, cell = quick_scenario(folder), folder / "cell"
    main(["run", str(scenario), "--save", str(cell)])
    loaded = ["--loaded", cell / "loaded.parquet", "--payload", cell / "payload.toml"]
    identify = ["identify", "--model", rx90_mjcf.MJCF, "--unloaded", cell / "unloaded.parquet", *loaded, "--format"]
    commands = {
        "help": ["check", "--help"],
        "text": [*identify, "text"],
        "json": [*identify, "json"],
        "check": ["check", "rx90", cell / "unloaded.parquet", *loaded],
        "run": ["run", scenario, "--save", folder / "again"],
    }
    outcomes = carried_out([["rx90", *map(str, words)] for words in commands.values()], folder)
    assert {each.status for each in outcomes} <= {0, 1}  # so short a motion may miss a tolerance
    return {name: each.modules for name, each in zip(commands, outcomes, strict=True)}


def test_to_run_a_scenario_imports_nothing_slow(imported):
    assert "sim.controller" in imported["run"]
    assert not imported["run"] & SLOW


def test_a_scenario_in_python_is_loaded_without_packages_of_studies():
    code = "import sys, scenarios; scenarios.load('ideal'); print({'pandas', 'pyarrow', 'filelock'} & {*sys.modules})"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "set()\n"


@pytest.mark.parametrize("form", ["text", "json"])
def test_to_identify_gains_by_any_model_imports_nothing_slow(imported, form):
    assert "ident.estimation.all_joints.search" in imported[form]
    assert not imported[form] & SLOW
    assert "mujoco" in imported[form]  # which confirms the kinematics, without a plant
    assert not imported[form] & {"rich.progress", "sim.effects", "sim.controller"}


def test_to_check_logs_imports_nothing_slow(imported):
    assert "scenarios.commands.check" in imported["check"]
    assert "ident.diagnosis.engine" in imported["check"]
    assert not imported["check"] & SLOW


def test_help_of_a_command_imports_no_simulator_and_no_other_command(imported):
    assert "scenarios.commands.check" in imported["help"]
    unwanted = {"mujoco", "pinocchio", "pydantic", "rich", "pyarrow", "scenarios.commands.identify"}
    assert not imported["help"] & (SLOW | unwanted)
