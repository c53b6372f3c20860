"""What becomes of a mutant: which tests run its line, and whether one of them notices."""

import ast
import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from bench.mutants import plugin
from bench.mutants.candidates import Candidate, Change
from bench.mutants.trial import Ran, Reach, run

SPARE, TIMES = 20.0, 6.0
"""A test may last this much longer [s] and this many times as long as without a change."""
START_UP = 60.0
"""Time for imports and collection [s]."""
PATIENCE = 60.0
"""The tests of one mutant take this long together at most, unchanged [s]; what they miss counts as survived."""
SURVIVED = "survived"
EQUIVALENT = "equivalent"
TOO_LONG = "too long"


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a mutant.

    Attributes:
        candidate: What was changed.
        change: The lines.
        outcome: `survived`, `equivalent`, or how it was noticed.
        by: The test that noticed, or what is to be said of a survivor.
        tests: How many tests run the line.
        seconds: Time it took [s].
    """

    candidate: Candidate
    change: Change
    outcome: str
    by: str
    tests: int
    seconds: float

    @property
    def package(self) -> str:
        return self.candidate.path.partition("/")[0]


def tests_of(candidate: Candidate, folder: Path, reached: Reach, seconds: Mapping[str, float]) -> list[str]:
    """Tests that run the line: those of its own module first, then the quickest, as many as `PATIENCE` allows.

    What runs at import has no tests of its own: those of the file count, and of the files that import it.

    Args:
        candidate: What is changed.
        folder: A copy of the project.
        reached: Which tests run which lines.
        seconds: Time of every test that counts [s].
    """
    tests = reached.of(candidate.path, *candidate.statement)
    if candidate.at_import:
        tests |= reached.anywhere([candidate.path, *_importers(candidate.path, folder)])
    path = Path(candidate.path)
    own = re.compile(rf"tests/{path.parts[0]}/(.+/)?test_{path.stem}\.py::|{re.escape(candidate.path)}::")
    ordered = sorted(tests & seconds.keys(), key=lambda test: (not own.match(test), seconds[test]))
    spent = list(accumulate(seconds[test] for test in ordered))
    return [test for k, test in enumerate(ordered) if k == 0 or spent[k] <= PATIENCE]


def tried(
    candidate: Candidate, change: Change, tests: Sequence[str], seconds: Mapping[str, float], folder: Path
) -> Result:
    """Change a copy of the project, run the tests, undo the change.

    Args:
        candidate: What is changed.
        change: The lines.
        tests: That run the line, in order.
        seconds: Time of every test without the change [s].
        folder: The copy.
    """
    if not tests:
        return Result(candidate, change, SURVIVED, "no test runs this line", 0, 0.0)
    began = time.monotonic()
    limits = {test: SPARE + TIMES * seconds[test] for test in tests}
    whole = START_UP + SPARE + TIMES * sum(seconds[test] for test in tests)
    file = folder / candidate.path
    original, times = file.read_bytes(), file.stat()
    file.write_text(change.source, encoding="utf-8")
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns + 10**10))  # compiled files know theirs by its time
    try:
        ran = run(folder, limits, seconds=whole)
    finally:
        file.write_bytes(original)
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    outcome, by = _outcome(ran)
    return Result(candidate, change, outcome, by, len(tests), time.monotonic() - began)


def _importers(path: str, root: Path) -> list[str]:
    module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    found: list[str] = []
    for package in {path.partition("/")[0], "sim", "scenarios"}:
        for file in (root / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or "", *(f"{node.module}.{a.name}" for a in node.names)]
                if module in names:
                    found.append(file.relative_to(root).as_posix())
    return found


def _outcome(ran: Ran) -> tuple[str, str]:
    by = next((f"{test}: {why}" for test, why in ran.failed.items()), ran.said.strip()[-200:])
    match ran.status:
        case 0:
            return SURVIVED, ""
        case None | plugin.TOO_LONG:
            return TOO_LONG, by
        case 1:
            return "killed", by
        case 2 | 3 | 4:  # a test file, pytest itself or a conftest.py
            return "broken", by
        case 5:
            return SURVIVED, "the names of its tests changed"
        case status if status < 0:
            return "crashed", by
        case status:
            raise RuntimeError(f"pytest ended with status {status}: {ran.said[-2000:]}")
