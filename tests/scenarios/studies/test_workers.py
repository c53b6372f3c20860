import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from distributed import LocalCluster
from here import HERE
from places import ROOT
from rich.console import Console
from study_tasks import die_once, double_or_die, fail, refuse

from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.study import carry_out, monte_carlo
from scenarios.experiments.workers import completed, dask_workers, local_processes
from scenarios.support.errors import ScenarioError


def test_a_task_that_kills_its_worker_is_given_up_the_others_are_not_and_are_done_again(tmp_path):
    tasks = [(str(tmp_path / "marker"), x) for x in range(8)]
    with local_processes(2) as workers:
        # What they start imports as it would here: `python script.py` from beside the script.
        for name in ("PYTHONSAFEPATH", "PYTHONPATH", "PYTHONWARNINGS"):
            assert workers.open().submit(os.getenv, name).result() == os.getenv(name)
        found = dict(completed(workers, double_or_die, range(8, 20)))
        assert dict(completed(workers, die_once, tasks)) == {task: 2 * task[1] for task in tasks}
    assert found.pop(13).kind == "WorkerDied"
    assert found == {x: 2 * x for x in range(8, 20) if x != 13}


def test_a_task_that_fails_has_its_reason_and_workers_that_can_do_none_or_bring_nothing_back_end_it():
    failure = dict(completed(HERE, fail, [4]))[4]
    assert (failure.kind, str(failure)) == ("WorkerFailed", "its worker failed: ValueError: cannot double 4")
    with pytest.raises(ScenarioError, match="another version"):
        dict(completed(HERE, refuse, range(4)))
    with pytest.raises(ScenarioError, match="none of the first 3 chunks of trials returned: its worker failed: Value"):
        dict(completed(HERE, fail, range(100)))


def test_workers_end_when_the_script_that_started_them_is_killed(tmp_path):
    code = (
        "import os, signal\n"
        "from scenarios.experiments.workers import local_processes\n"
        "with local_processes(1) as workers:\n"  # without a guard, as users write it
        "    print(workers.open().submit(os.getpid).result(), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    (tmp_path / "script.py").write_text(code)
    words, environment = [sys.executable, "script.py"], os.environ | {"PYTHONPATH": str(ROOT)}
    killed = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert "Error" not in killed.stderr  # of a worker that began the script again
    worker, deadline = Path(f"/proc/{int(killed.stdout)}/stat"), time.monotonic() + 10.0
    while (alive := worker.exists() and ") Z " not in worker.read_text()) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of the cluster's own end
def test_a_cluster_has_the_rows_of_a_study_at_home_gives_up_a_task_that_kills_its_workers_and_may_end(
    scenario, tmp_path
):
    study = monte_carlo(load_scenario(str(scenario)), 2, seed=5)
    alone = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}
    cluster = LocalCluster(**alone, scheduler_kwargs={"allowed_failures": 0})
    with cluster, dask_workers(cluster.scheduler_address) as workers:
        there, here = (
            carry_out(study, tmp_path / name, where, command="", console=Console(quiet=True)).table()
            for name, where in (("cluster", workers), ("home", HERE))
        )
        found = dict(completed(workers, double_or_die, range(11, 16)))
        ended = completed(workers, double_or_die, range(100, 10_000))
        next(ended)
        cluster.close()
        with pytest.raises(ScenarioError, match="the scheduler has exited; finished trials are kept"):
            list(ended)
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
