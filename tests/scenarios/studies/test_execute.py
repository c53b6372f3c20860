import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from here import HERE
from places import ROOT
from study_tasks import die_once, double_or_die, fail, refuse

from scenarios.experiments.workers import completed, local_processes
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
