"""Commands carried out one after the other in a process of their own: to import what they need takes longest."""

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from places import ROOT


@dataclass(frozen=True)
class Outcome:
    """How a command ended, what it said, and the modules that the process had by then."""

    status: int
    out: str
    err: str
    modules: frozenset[str]


DRIVER = """
import contextlib, io, json, os, runpy, sys, traceback
exec(sys.argv[2])
from scenarios.cli import main
outcomes = []
for words in json.loads(sys.argv[1]):
    out, err, status = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            if words[0] == "python":
                runpy.run_path(words[1])
            elif words[0] == "pytest":
                import pytest
                with contextlib.chdir(os.environ["PYTHONPATH"]):
                    status = int(pytest.main(words[1:]))
            else:
                status = int(main(words[1:]))
        except SystemExit as error:
            status = int(error.code or 0)
        except Exception:
            status = 1
            traceback.print_exc()
    outcomes.append((status, out.getvalue(), err.getvalue(), list(sys.modules)))
print(json.dumps(outcomes))
"""


def carried_out(
    commands: list[list[str]], folder: Path, *, before: str = "", environment: Mapping[str, str] | None = None
) -> list[Outcome]:
    """What becomes of commands that begin with `rx90`, `python` or `pytest`, in a folder."""
    done = subprocess.run(
        [sys.executable, "-P", "-W", "ignore", "-c", DRIVER, json.dumps(commands), before],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [Outcome(*each, frozenset(modules)) for *each, modules in json.loads(done.stdout.splitlines()[-1])]


def rx90(*words: object, **more: str) -> subprocess.CompletedProcess[str]:
    """A command as a user starts it, with more in its environment."""
    command = [sys.executable, "-m", "scenarios", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=os.environ | more)
