import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pandas as pd
import pytest
from here import HERE
from places import ROOT
from quick import BRIEF, quick_scenario
from rich.console import Console
from study_tasks import double_or_die

from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import carry_out, monte_carlo
from scenarios.experiments.workers import completed, dask_workers
from scenarios.support.errors import ScenarioError

START = "import sys; from dask.__main__ import main; sys.argv[0] = 'dask'; main()"
Cluster = tuple[Path, subprocess.Popen]


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    """A scheduler and a worker process of one thread on loopback; yields the scheduler's file and process."""
    file = folder / "scheduler.json"
    environment = os.environ | {
        "PYTHONPATH": str(ROOT / "tests" / "helpers"),
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
    }
    common = ["--scheduler-file", str(file), "--host", "127.0.0.1", "--no-dashboard"]
    worker = ["worker", "--nthreads", "1", "--local-directory", str(folder)]
    started = []
    try:
        for arguments in (["scheduler", "--port", "0"], worker):
            with (folder / f"{len(started)}.log").open("w") as log:
                command = [sys.executable, "-c", START, *arguments, *common]
                started.append(
                    subprocess.Popen(command, stdout=log, stderr=log, env=environment, start_new_session=True)
                )
        deadline = time.monotonic() + 60.0
        while not (file.exists() and file.read_text().endswith("}")) and time.monotonic() < deadline:
            time.sleep(0.05)
        yield file, started[0]
    finally:
        for process in reversed(started):  # a worker has a child that works and is started anew
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@pytest.mark.slow
def test_a_cluster_has_the_rows_of_a_study_at_home_and_gives_up_a_task_that_kills_its_workers(scenario, tmp_path):
    study = monte_carlo(load_scenario(str(scenario)), 2, seed=5)
    with cluster(tmp_path) as (file, _), dask_workers(str(file)) as workers:
        there, here = (
            carry_out(study, tmp_path / name, where, command="", console=Console(quiet=True)).table()
            for name, where in (("cluster", workers), ("home", HERE))
        )
        found = dict(completed(workers, double_or_die, range(11, 16)))
    pd.testing.assert_frame_equal(there, here, check_exact=True)
    assert found.pop(13).kind == "WorkerDied"
    assert found == {x: 2 * x for x in range(11, 16) if x != 13}


def test_a_scheduler_file_that_is_not_there_or_has_no_address_and_one_that_cannot_be_are_refused(tmp_path):
    file = tmp_path / "s.json"
    with pytest.raises(ScenarioError, match=r"s\.json: no such scheduler file"), dask_workers(str(file)):
        pass
    for text in ("", "[]", '{"address_": "tcp://127.0.0.1:8786"}'):
        file.write_text(text)
        with pytest.raises(ScenarioError, match=r"s\.json: not a scheduler file"), dask_workers(str(file)):
            pass
    for address in ("tls://127.0.0.1:1", "foo://127.0.0.1:1", "nonsense", "tcp://127.0.0.1"):
        with pytest.raises(ScenarioError, match=f"no Dask scheduler answers at {address}: .*"), dask_workers(address):
            pass


def test_a_port_that_takes_the_connection_and_says_nothing_is_refused_in_time(monkeypatch):
    monkeypatch.setattr("scenarios.experiments.workers.PATIENCE", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        said, started = f"no Dask scheduler answers at {address} within 0.3 s", time.monotonic()
        with pytest.raises(ScenarioError, match=said), dask_workers(address):
            pass
    assert time.monotonic() - started < 60.0


@pytest.mark.slow
def test_a_scheduler_that_dies_ends_a_command_with_one_line_and_2(tmp_path):
    words = ["monte-carlo", str(quick_scenario(tmp_path, lasts=BRIEF)), "-n", "4000", "--out", str(tmp_path / "out")]
    with cluster(tmp_path) as (file, process):
        words = [sys.executable, "-m", "scenarios", *words, "--dask", str(file)]
        command = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, cwd=ROOT)
        deadline = time.monotonic() + 120.0
        while not (tmp_path / "out" / "study.json").exists() and time.monotonic() < deadline:
            assert command.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
        _, errors = command.communicate(timeout=120.0)
    assert command.returncode == 2
    said = [line for line in errors.splitlines() if not line.startswith("monte-carlo quick: ")]  # progress
    assert said == ["rx90: the scheduler has exited; finished trials are kept; repeat the command"]
