import os
import signal
import subprocess
import sys
import time

import pytest
from one_process import carried_out, rx90
from places import ROOT
from quick import BRIEF, quick_scenario
from signals import as_in_the_foreground
from weighed_cell import PLAIN, identified

from scenarios.command_line.process import OPENGL
from scenarios.commands import COMMANDS

RX90 = f"{sys.executable} -m scenarios"


@pytest.mark.parametrize(
    ("line", "status", "error"),
    [
        (f"{RX90} list >/dev/full", 74, "rx90: standard output: No space left on device\n"),
        (f"{RX90} run nominal >&-", 74, "rx90: standard output: closed\n"),
        (f"{RX90} list <&- >/dev/null", 0, ""),
        (f"{RX90} list >/dev/full 2>/dev/full", 74, ""),
        (f"(sleep 1; {RX90} list; echo $? >&2) | true", 0, "141\n"),
    ],
)
def test_streams_that_cannot_be_written_have_a_status_and_a_line(line, status, error):
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, error)


def test_a_terminal_that_knows_ascii_alone_gets_every_line():
    ascii_alone = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    listed, wrong = (
        subprocess.run([sys.executable, "-m", "scenarios", word], capture_output=True, env=ascii_alone, check=False)
        for word in ("list", "ä")
    )
    assert (listed.returncode, listed.stderr) == (0, b"")
    assert (wrong.returncode, wrong.stderr.count(b"\n")) == (2, 1)


LISTING = """import os, signal, sys, time
import scenarios.commands.catalog as module
from scenarios.cli import main
names = module.builtin_names
module.builtin_names = lambda: ({during}, names())[1]
{before}
sys.exit(main(["list"]))
"""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_is_one_line_and_its_status(number, status, tmp_path):
    during = f"open({str(tmp_path / 'there')!r}, 'w').close(), time.sleep(60)"
    code = [sys.executable, "-c", LISTING.format(before="", during=during)]
    running = subprocess.Popen(code, stderr=subprocess.PIPE, text=True, preexec_fn=as_in_the_foreground)
    deadline = time.monotonic() + 60.0
    while not (tmp_path / "there").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.3)  # it sleeps by now
    running.send_signal(number)
    _, error = running.communicate(timeout=30.0)
    assert (running.returncode, error) == (status, "rx90: stopped\n")


def test_a_signal_that_is_ignored_stays_so():
    before, during = "signal.signal(signal.SIGHUP, signal.SIG_IGN)", "os.kill(os.getpid(), signal.SIGHUP)"
    code = LISTING.format(before=before, during=during)
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


OTHERS = {"pinocchio": "from .pinocchio_pywrap_default import *", "numpy": "from . import _multiarray", "coal": ""}


@pytest.mark.slow
def test_packages_of_another_python_give_way_and_what_draws_nothing_needs_no_opengl(tmp_path):
    for name, content in OTHERS.items():
        folder = tmp_path / "ros" / name
        folder.mkdir(parents=True)
        (folder / "__init__.py").write_text(content + "\n")
    path = os.pathsep.join((str(ROOT), str(tmp_path / "ros")))
    scenario = quick_scenario(tmp_path, lasts=BRIEF)
    done = rx90("run", scenario, "--quiet", **{"PYTHONPATH": path, OPENGL: "no-such-thing"})
    assert done.returncode in (0, 1)  # so short a motion may miss a tolerance
    assert (done.stdout != "", done.stderr) == (True, "")


def test_what_draws_says_in_one_line_that_the_opengl_asked_for_is_not_there(tmp_path):
    done = rx90("view", "nominal", "--render", tmp_path / "a.png", "--quiet", **{OPENGL: "no-such-thing"})
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("rx90: MUJOCO_GL=no-such-thing: this OpenGL backend is not available")
    assert done.stderr.count("\n") == 1


SLOW = {"pandas", "matplotlib", "jinja2", "glfw", "pyarrow.compute", "urllib.request"}
SLOW |= {"scipy.signal", "scipy.stats", "scipy.ndimage", "asyncio"}
"""What reads no Parquet, filters no recording and identifies no gain."""
DRAWN = """
[random.both]
target = ["plant.payload.mass", "plant.gain"]
distribution = "norm"
parameters = { scale = 0.003 }
apply = "add"
"""


@pytest.fixture(scope="module")
def imported(weighed_cell, tmp_path_factory) -> dict[str, frozenset[str]]:
    """What is imported when each command has ended, one after the other in one process, the simulator last."""
    folder = tmp_path_factory.mktemp("imports")
    commands = {
        "identify": [*identified(weighed_cell), *PLAIN],
        "check": ["check", "rx90", weighed_cell / "run" / "unloaded.parquet"],
        "run": ["run", quick_scenario(folder, DRAWN, lasts=BRIEF), "--save", folder / "again"],
    }
    outcomes = carried_out([["rx90", *map(str, words)] for words in commands.values()], folder)
    assert {each.status for each in outcomes} <= {0, 1}  # so short a motion may miss a tolerance
    return {name: each.modules for name, each in zip(commands, outcomes, strict=True)}


def test_no_command_imports_what_is_slow_and_what_it_does_not_need(imported):
    for name, needed in (
        ("run", "sim.controller"),
        ("identify", "ident.estimation.all_joints"),
        ("identify", "mujoco"),  # which confirms the kinematics, without a plant
        ("check", "ident.diagnosis.search"),
    ):
        assert needed in imported[name]
        assert not imported[name] & SLOW, name
    assert not imported["identify"] & {"rich.progress", "sim.effects", "sim.controller"}


HEAVY = {"mujoco", "pinocchio", "pandas", "matplotlib", "pyarrow", "scipy.signal", "scipy.stats"}


def test_what_one_asks_first_help_and_a_scenario_that_is_missed_import_nothing_that_is_heavy(tmp_path):
    first = [[], ["--help"], ["--version"], ["list"], ["list", "--help"], ["rnu"]]
    # `compare` takes what may be no scenario, and finds out later; `schema` names what it finds in the results.
    named = ("run", "view", "payload", "predict")
    then = [[name, "--help"] for name in COMMANDS if name != "schema"] + [[name, "nominl"] for name in named]
    loaded = [each.modules for each in carried_out([["rx90", *words] for words in first + then], tmp_path)]
    light, helped = loaded[len(first) - 1], loaded[-1]
    assert "scenarios.commands.catalog" in light
    assert not light & (HEAVY | {"numpy", "scipy", "pydantic", "rich", "scenarios.commands.identification"})
    assert not helped & HEAVY
