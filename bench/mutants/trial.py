"""Tests run in copies of the project: unchanged, to see which test runs which line, and with one change at a time."""

import json
import os
import shutil
import signal
import subprocess
import sys
import uuid
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import coverage
import psutil

from bench.mutants import plugin

LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "out", "dist", "__pycache__", ".pytest_cache", ".ruff_cache")
MARK = "MUTANTS_RUN"
"""In the environment of every process of a run."""
NO_TESTS = 5
"""pytest's exit status where there was none to run."""


@dataclass(frozen=True, slots=True)
class Ran:
    """How a run of tests ended.

    Attributes:
        status: pytest's exit status; negative if a signal ended it, None if it did not end in time.
        seconds: Time each test took [s].
        failed: Why each failed test failed.
        said: What pytest printed.
    """

    status: int | None
    seconds: Mapping[str, float]
    failed: Mapping[str, str]
    said: str


@dataclass(frozen=True, slots=True)
class Reach:
    """Which tests run which lines.

    Attributes:
        lines: Tests by file, then by line.
    """

    lines: Mapping[str, Mapping[int, frozenset[str]]]

    def of(self, path: str, first: int, last: int) -> set[str]:
        """Tests that run any of these lines."""
        here = self.lines.get(path, {})
        return {test for line in range(first, last + 1) for test in here.get(line, ())}

    def __or__(self, other: "Reach") -> "Reach":
        """What either has."""
        files = self.lines.keys() | other.lines.keys()
        both = {file: (self.lines.get(file, {}), other.lines.get(file, {})) for file in files}
        none: frozenset[str] = frozenset()
        return Reach(
            {
                file: {line: a.get(line, none) | b.get(line, none) for line in a.keys() | b.keys()}
                for file, (a, b) in both.items()
            }
        )

    def anywhere(self, paths: Iterable[str]) -> set[str]:
        """Tests that run any function of these files."""
        return {test for path in paths for tests in self.lines.get(path, {}).values() for test in tests}


def ended(status: int | None, seconds: float) -> str:
    """How a run ended, in words.

    Args:
        status: As in `Ran`.
        seconds: Its time limit.
    """
    if status is None:
        return f"pytest had not ended after {seconds:g} s"
    return f"signal {-status} ended pytest" if status < 0 else f"pytest ended with status {status}"


def copy_of(root: Path, to: Path) -> Path:
    """A copy of the project, without what is built."""
    shutil.copytree(root, to, ignore=LEFT_OUT)
    return to


def trace(folder: Path, at: Iterable[str], *, share: tuple[int, int], seconds: float) -> tuple[Ran, Reach]:
    """Run a share of the tests unchanged and note which lines each runs.

    Args:
        folder: A copy of the project.
        at: Files and folders of tests; none: all.
        share: (k, n): every n-th test from the k-th on.
        seconds: Time limit of the whole.
    """
    beside = _emptied(folder)
    (beside / "coverage.ini").write_text(_settings(folder, beside))
    tracing = {
        plugin.COVER: str(beside / "fixtures.json"),
        plugin.CONTEXT: "",
        "COVERAGE_PROCESS_START": str(beside / "coverage.ini"),  # each process reads its context anew
    }
    ran = _run(folder, beside, {"tests": {}, "share": share}, tracing, at, seconds)
    return ran, _reach(folder, beside) if ran.seconds else Reach({})


def run(folder: Path, tests: Mapping[str, float], *, seconds: float) -> Ran:
    """Run tests in a copy of the project until the first that fails.

    Args:
        folder: The copy.
        tests: Time limit of each [s], in order.
        seconds: Time limit of the whole.
    """
    uncompiled = {"PYTHONDONTWRITEBYTECODE": "1"}  # a mutant's compiled file is nobody else's
    files = dict.fromkeys(test.partition("::")[0] for test in tests)
    plan = {"tests": dict(tests), "share": (0, 1)}
    return _run(folder, _emptied(folder), plan, uncompiled, ["-x", *files], seconds)


def _emptied(folder: Path) -> Path:
    """A new folder beside a copy, for what a run of its tests leaves."""
    beside = folder.with_name(folder.name + "-run")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir()
    return beside


def _run(
    folder: Path,
    beside: Path,
    plan: Mapping[str, object],
    more: Mapping[str, str],
    arguments: Iterable[str],
    seconds: float,
) -> Ran:
    """pytest in a process of its own; nothing it started is left behind."""
    report, file = beside / "report.json", beside / "plan.json"
    file.write_text(json.dumps({**plan, "report": str(report)}))
    mark = uuid.uuid4().hex
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "HYPOTHESIS_STORAGE_DIRECTORY": str(beside / "hypothesis"),  # one mutant's examples are not the next one's
        plugin.PLAN: str(file),
        MARK: mark,
        **more,
    }
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", plugin.__name__]
    command += [f"--basetemp={beside / 'tmp'}", "--hypothesis-seed=0", *arguments]
    with (beside / "output.txt").open("w") as output:
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
        )
        try:
            status = process.wait(seconds)
        except subprocess.TimeoutExpired:
            status = None
        finally:
            _end(mark)
            process.wait()
    said = (beside / "output.txt").read_text(errors="replace")
    told = json.loads(report.read_text()) if report.is_file() else {"seconds": {}, "failed": {}}
    return Ran(status, told["seconds"], told["failed"], said)


def _reach(folder: Path, beside: Path) -> Reach:
    measured = coverage.Coverage(config_file=str(beside / "coverage.ini"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a process that a test kills leaves half a file
        measured.combine()
    users: dict[str, set[str]] = {}
    for test, fixtures in json.loads((beside / "fixtures.json").read_text()).items():
        for name in fixtures:
            users.setdefault(f"fixture:{name}", set()).add(test)
    data = measured.get_data()
    lines: dict[str, dict[int, frozenset[str]]] = {}
    for file in data.measured_files():
        path = Path(file).relative_to(folder).as_posix()
        lines[path] = {
            line: frozenset(test for context in contexts if context for test in users.get(context, {context}))
            for line, contexts in data.contexts_by_lineno(file).items()
        }
    return Reach(lines)


def _settings(folder: Path, beside: Path) -> str:
    return "\n".join(
        [
            "[run]",
            f"source = {', '.join(str(folder / package) for package in ('ident', 'sim', 'scenarios'))}",
            f"data_file = {beside / 'hits'}",
            "parallel = true",
            f"context = ${{{plugin.CONTEXT}-}}",
            "concurrency = multiprocessing, thread",
            "sigterm = true",
            "disable_warnings = no-data-collected, module-not-imported, module-not-measured, already-imported",
        ]
    )


def _end(mark: str) -> None:
    """End every process of a run, also those that left its group."""
    for process in psutil.process_iter():
        try:
            if process.environ().get(MARK) == mark:
                process.send_signal(signal.SIGKILL)
        except psutil.Error:
            continue
