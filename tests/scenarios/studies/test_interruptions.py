"""Studies that are killed or stopped from outside, as processes of their own.

Nothing here waits for a fixed time: the moment is one that the study's folder shows, and a deadline is for a machine so
busy that the rest of the suite would have failed on it.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
import pytest
from places import ROOT
from quick import BRIEF, RANDOM, quick_scenario
from rich.console import Console
from signals import as_in_the_foreground

from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import carry_out, monte_carlo
from scenarios.experiments.workers import Workers

DEADLINE = 120.0
TRIALS, PARTS = 8, 8
"""On two workers, four chunks a worker."""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory) -> Path:
    return quick_scenario(tmp_path_factory.mktemp("quick"), RANDOM, lasts=BRIEF)


def rx90(*words: object) -> list[str]:
    return [sys.executable, "-m", "scenarios", *map(str, words)]


def started(
    words: list[str], prepared: Callable[[], None] = as_in_the_foreground, folder: Path = ROOT
) -> subprocess.Popen:
    """A command in a session of its own, as a terminal starts it in a folder."""
    return subprocess.Popen(
        words,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        preexec_fn=prepared,
    )


def parts(folder: Path) -> dict[str, int]:
    """The parts of a study and when they were written."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "trials").glob("*.parquet")}


def wait_until(reached: Callable[[], object], process: subprocess.Popen) -> None:
    deadline = time.monotonic() + DEADLINE
    while not reached() and time.monotonic() < deadline:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.005)
    assert reached()


@pytest.fixture
def misleading(tmp_path) -> Path:
    """A folder with modules of names that the command and its workers import from elsewhere."""
    (folder := tmp_path / "misleading").mkdir()
    for name in ("sim", "ident", "rx90_mjcf", "random", "queue", "tomllib"):
        (folder / f"{name}.py").write_text("raise SystemExit('imported from the working folder')")
    return folder


def test_a_killed_study_goes_on_and_ends_with_the_rows_of_one_that_was_not(scenario, misleading, tmp_path):
    more = ("-n", TRIALS, "--seed", 5)
    for attempt in range(5):  # a kill that comes after the last part is no test
        folder = tmp_path / f"killed-{attempt}"
        killed = started(rx90("monte-carlo", scenario, "--out", folder, *more, "--jobs", 2), folder=misleading)
        wait_until(lambda: parts(folder), killed)  # noqa: B023 (called at once)
        os.killpg(killed.pid, signal.SIGKILL)
        assert killed.wait() == -signal.SIGKILL
        killed.stderr.close()
        kept = parts(folder)
        if len(kept) < PARTS:
            break
    assert 0 < len(kept) < PARTS
    assert not any("lost" in name for name in kept)  # of workers that were misled
    assert main(["monte-carlo", str(scenario), "--out", str(folder), *map(str, more), "--jobs", "1"]) in (0, 1)
    study, here = (
        monte_carlo(load_scenario(str(scenario)), TRIALS, 5),
        Workers(lambda: ThreadPoolExecutor(1), lambda: 1),
    )
    carry_out(study, tmp_path / "whole", here, command="", console=Console(quiet=True))
    assert parts(folder).items() >= kept.items()  # what was finished is not done again
    again, whole = (
        pd.read_parquet(place / "trials").sort_values(["trial", "joint"], ignore_index=True)
        for place in (folder, tmp_path / "whole")
    )
    assert again["trial"].nunique() == TRIALS
    pd.testing.assert_frame_equal(again, whole, check_exact=True)
    assert (folder / "summary.parquet").is_file()


@pytest.mark.parametrize(
    ("send", "number", "status"), [(os.killpg, signal.SIGINT, 130), (os.kill, signal.SIGTERM, 143)]
)
def test_a_study_that_is_stopped_keeps_its_parts_and_says_how_to_go_on(scenario, tmp_path, send, number, status):
    """As a terminal sends Ctrl-C, to every process, and as `kill` sends its signal."""
    running = started(rx90("monte-carlo", scenario, "--out", tmp_path / "s", "-n", 40, "--jobs", 2))
    wait_until(lambda: list((tmp_path / "s").glob("trials/*.parquet")), running)
    kept = parts(tmp_path / "s")
    send(running.pid, number)
    _, errors = running.communicate(timeout=DEADLINE)
    assert running.returncode == status
    said = [line for line in errors.splitlines() if not line.startswith("monte-carlo quick: ")]  # progress
    assert said == [
        f"rx90: stopped; finished trials are kept; continue with: rx90 monte-carlo {scenario} -n 40 "
        f"--out {tmp_path / 's'} --seed 0 --jobs 2"
    ]
    assert parts(tmp_path / "s").items() >= kept.items()


STUCK = """
import threading
import scenarios.commands.studies as study
study.PATIENCE = 0.2
threading.Thread(target=threading.Event().wait).start()  # Python would wait for it for ever
with study.interruptible("rx90 again"):
    raise KeyboardInterrupt
"""


def test_an_interrupted_study_ends_though_a_thread_of_it_does_not():
    done = subprocess.run([sys.executable, "-c", STUCK], capture_output=True, text=True, timeout=60.0, cwd=ROOT)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "rx90: stopped; finished trials are kept; continue with: rx90 again\n"
