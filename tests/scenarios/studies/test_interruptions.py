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
from pathlib import Path

import pandas as pd
import pytest
from here import HERE
from places import ROOT
from rich.console import Console
from signals import as_in_the_foreground
from undiagnosed import undiagnosed

from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import carry_out, monte_carlo
from scenarios.experiments.trials import OUTSIDE

DEADLINE = 120.0
TRIALS = 5


def parts(folder: Path) -> dict[str, int]:
    """The parts of a study and when they were written."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "trials").glob("*.parquet")}


def wait_until(reached: Callable[[], object], process: subprocess.Popen) -> None:
    deadline = time.monotonic() + DEADLINE
    while not reached() and time.monotonic() < deadline:
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.005)
    assert reached()


@pytest.mark.parametrize(
    "signals", [(signal.SIGINT,), pytest.param((signal.SIGKILL, signal.SIGINT), marks=pytest.mark.slow)]
)
def test_a_study_that_is_killed_or_stopped_ends_with_the_rows_of_one_that_was_not(scenario, tmp_path, signals):
    """Killed; stopped as a terminal sends Ctrl-C, to every process; finished."""
    (misleading := tmp_path / "misleading").mkdir()  # modules that the command and its workers import from elsewhere
    for name in ("sim", "ident", "rx90_mjcf", "random", "queue", "tomllib"):
        (misleading / f"{name}.py").write_text("raise SystemExit('imported from the working folder')")
    folder, kept = tmp_path / "s", dict[str, int]()
    command = f"rx90 monte-carlo {scenario} -n {TRIALS} --out {folder} --seed 5 --jobs 1"
    words = [sys.executable, "-m", "scenarios", *command.split()[1:]]
    for number in signals:
        running = subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=misleading,
            env=os.environ | {"PYTHONPATH": str(ROOT)}, preexec_fn=as_in_the_foreground,
        )  # fmt: skip
        wait_until(lambda: parts(folder).keys() - kept.keys(), running)  # noqa: B023 (called at once)
        os.killpg(running.pid, number)
        _, errors = running.communicate(timeout=DEADLINE)
        assert running.returncode == (130 if number == signal.SIGINT else -number)
        said = [line for line in errors.splitlines() if not line.startswith("monte-carlo quick: ")]  # progress
        stopped = [f"rx90: stopped; finished trials are kept; continue with: {command}"]
        assert said == ([] if number == signal.SIGKILL else stopped)
        before, kept = kept, parts(folder)
        assert kept.items() >= before.items()  # what was finished is not done again
        assert not pd.read_parquet(folder / "trials")["failure"].isin(OUTSIDE).any()  # of workers that were misled
    study = monte_carlo(load_scenario(str(scenario)), TRIALS, 5)
    with undiagnosed():
        again, whole = (
            carry_out(study, place, HERE, command="", console=Console(quiet=True)).table()
            for place in (folder, tmp_path / "whole")
        )
    assert parts(folder).items() > kept.items()  # a signal after the last part is no test
    assert again["trial"].nunique() == TRIALS
    pd.testing.assert_frame_equal(again, whole, check_exact=True)


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
