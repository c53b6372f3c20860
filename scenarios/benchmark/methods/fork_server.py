"""Processes for methods written in Python, forked from one that has imported what they need: 20 ms instead of seconds.

The helper reads a request a line, forks, tells the number of the new process, waits for it and tells its status. It
does nothing else and has one thread, so that a fork is safe; it ends when the one that asks has gone.
"""

import atexit
import json
import os
import select
import subprocess
import sys
import threading
import traceback
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from scenarios.benchmark.methods.environment import environment
from scenarios.support.errors import MethodNotStarted

HELPER = (sys.executable, "-P", "-m", "scenarios.benchmark.methods.fork_server")
PATIENCE = 120.0
"""Time that the helper may take to import [s]."""


class Nursling:
    """A forked process, and the helper that waits for it."""

    def __init__(self, helper: subprocess.Popen[bytes], pid: int) -> None:
        self._helper, self.pid = helper, pid
        self._status: int | None = None

    def wait(self, timeout: float) -> int | None:
        """Its exit status, negative for a signal; None if it has not ended in time [s].

        Raises:
            MethodNotStarted: If the helper has gone.
        """
        if self._status is None:
            line = _line(self._helper, timeout)
            self._status = None if line is None else int(line)
        return self._status


def can_fork() -> bool:
    """Whether this system forks; elsewhere every call starts a process anew."""
    return sys.platform == "linux"


def forked(words: Sequence[str], out: Path, err: Path) -> Nursling:
    """Fork a process for a method written in Python.

    Args:
        words: Method and folder.
        out: Existing file that gets its standard output.
        err: The same for its standard error.

    Raises:
        MethodNotStarted: If there is no helper.
    """
    helper = ready_helper()
    assert helper.stdin is not None, "it was started with a pipe"
    try:
        helper.stdin.write(json.dumps([*words, str(out), str(err), os.getcwd()]).encode() + b"\n")
        helper.stdin.flush()
    except OSError as error:
        raise MethodNotStarted("the fork server has exited") from error
    line = _line(helper, PATIENCE)
    if line is None:
        raise MethodNotStarted(f"the fork server has not answered for {PATIENCE:g} s")
    return Nursling(helper, int(line))


def _line(helper: subprocess.Popen[bytes], timeout: float) -> bytes | None:
    assert helper.stdout is not None, "it was started with a pipe"
    if not select.select([helper.stdout], [], [], timeout)[0]:
        return None
    line = helper.stdout.readline()  # unbuffered, and lines are written whole
    if not line:
        _running.cache_clear()
        raise MethodNotStarted("the fork server has died")
    return line


def ready_helper() -> subprocess.Popen[bytes]:
    """The helper of this process and thread, once it can fork at once; started when it is first asked for, or has died.

    Raises:
        MethodNotStarted: If it cannot start.
    """
    owner = os.getpid(), threading.get_ident()
    helper = _running(*owner)
    if helper.poll() is not None:
        _running.cache_clear()
        helper = _running(*owner)
    return helper


@lru_cache(maxsize=64)
def _running(process: int, thread: int) -> subprocess.Popen[bytes]:
    helper = subprocess.Popen(
        HELPER, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, env=environment(), start_new_session=True
    )
    atexit.register(_ended, helper)
    if _line(helper, PATIENCE) is None:
        raise MethodNotStarted(f"the fork server has not answered for {PATIENCE:g} s")
    return helper


def _ended(helper: subprocess.Popen[bytes]) -> None:
    for pipe in (helper.stdin, helper.stdout):
        if pipe is not None:
            pipe.close()
    helper.kill()
    helper.wait()


def _serve() -> None:
    """The helper's life."""
    import scenarios.benchmark.methods.inside as inside

    inside.prepare()
    _tell(os.getpid())
    for line in sys.stdin.buffer:
        text, folder, out, err, work = json.loads(line)
        pid = os.fork()
        if not pid:
            os._exit(_lived(text, Path(folder), (out, err), work))
        _tell(pid)
        _tell(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


def _tell(number: int) -> None:
    os.write(1, b"%d\n" % number)


def _lived(text: str, folder: Path, files: tuple[str, str], work: str) -> int:
    """Call a method in the forked process; its exit status."""
    import scenarios.benchmark.methods.inside as inside

    os.setsid()
    for number, place in zip((1, 2), files, strict=True):
        os.dup2(os.open(place, os.O_WRONLY | os.O_APPEND), number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    try:
        os.chdir(work)
        inside.main(text, folder)
        sys.stderr.flush()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    except BaseException:  # whatever it is, this process ends with it
        traceback.print_exc()
        sys.stderr.flush()
        return 1
    return 0


if __name__ == "__main__":
    _serve()
