"""Tests run in copies of the project: unchanged, to see which test runs which line, and with one change at a time."""

import json
import os
import shutil
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import coverage
import psutil

from bench.mutants import plugin

LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "out", "dist", "__pycache__", ".pytest_cache", ".ruff_cache")
MARK = "MUTANTS_RUN"
"""In the environment of every process of a run."""


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

    def anywhere(self, paths: Iterable[str]) -> set[str]:
        """Tests that run any function of these files."""
        return {test for path in paths for tests in self.lines.get(path, {}).values() for test in tests}


def copy_of(root: Path, to: Path) -> Path:
    """A copy of the project, without what is built."""
    shutil.copytree(root, to, ignore=LEFT_OUT)
    return to


def run(
    folder: Path,
    tests: Mapping[str, float],
    *,
    at: Iterable[str] = (),
    seconds: float,
    first: bool,
    cover: bool = False,
) -> Ran:
    """Run tests in a copy of the project; nothing they started is left behind.

    Args:
        folder: The copy.
        tests: Time limit of each [s], in order; none: all tests.
        at: Files and folders to collect from, if there are no tests.
        seconds: Time limit of the whole.
        first: Stop at the first failure.
        cover: Note which lines each test runs.
    """
    beside = folder.with_name(folder.name + "-run")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir()
    plan, report = beside / "plan.json", beside / "report.json"
    plan.write_text(json.dumps({"tests": dict(tests), "report": str(report)}))
    mark = uuid.uuid4().hex
    environment = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        plugin.PLAN: str(plan),
        "HYPOTHESIS_STORAGE_DIRECTORY": str(
            beside / "hypothesis"
        ),  # what one mutant failed of is no example for the next
        MARK: mark,
    }
    if tests:
        environment["PYTHONDONTWRITEBYTECODE"] = "1"  # a mutant's compiled file is nobody else's
    if cover:
        (beside / "coverage.ini").write_text(_settings(folder, beside))
        environment |= {plugin.COVER: str(beside / "fixtures.json"), plugin.CONTEXT: ""}
        environment["COVERAGE_PROCESS_START"] = str(beside / "coverage.ini")  # each process reads its context anew
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", plugin.__name__]
    command += [f"--basetemp={beside / 'tmp'}", *(["-x"] if first else [])]
    command += ["--hypothesis-seed=0", *dict.fromkeys(t.split("::")[0] for t in tests), *at]
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


def reach(folder: Path) -> Reach:
    """Which tests run which lines, after a run with `cover`."""
    beside = folder.with_name(folder.name + "-run")
    measured = coverage.Coverage(config_file=str(beside / "coverage.ini"))
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
