"""What one asks first imports nothing that is heavy."""

import subprocess
import sys

import pytest

from scenarios.commands import COMMANDS

HEAVY = {"mujoco", "pinocchio", "pandas", "matplotlib", "pyarrow", "scipy.signal", "scipy.stats"}


def loaded_by(*commands: list[str]) -> set[str]:
    """Modules of a process of its own that carries out commands, which may exit."""
    code = (
        "import contextlib, sys\n"
        "from scenarios.cli import main\n"
        f"for words in {commands}:\n"
        "    with contextlib.suppress(SystemExit):\n"
        "        main(words)\n"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def test_what_one_asks_first_imports_nothing_that_is_heavy():
    loaded = loaded_by([], ["--help"], ["--version"], ["list"], ["list", "--help"], ["rnu"], ["schema", "result"])
    assert "scenarios.commands.list" in loaded
    assert not loaded & (HEAVY | {"numpy", "scipy", "pydantic", "rich", "scenarios.commands.run"})


def test_a_scenario_is_missed_and_help_is_told_before_anything_heavy_is_imported():
    # `trajectory` and `compare` take what may be no scenario, and find out later.
    named = ("run", "view", "payload", "predict")
    words = [[name, "--help"] for name in COMMANDS] + [[name, "nominl"] for name in named]
    assert not loaded_by(*words) & HEAVY


@pytest.mark.parametrize("words", [["list"], ["lsit"]])
def test_a_process_that_ends_leaves_its_objects_to_the_system(words: list[str]) -> None:
    # Python would look through all of them for cycles once more, which takes longer than to import SciPy.
    code = (
        "import contextlib, gc, sys\n"
        "from scenarios.__main__ import main\n"
        f"sys.argv = ['rx90', *{words}]\n"
        "with contextlib.suppress(SystemExit):\n"
        "    main()\n"
        "print(gc.get_freeze_count(), len(gc.get_objects()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    kept, searched = map(int, done.stdout.splitlines()[-1].split())
    assert kept > 100 * searched
