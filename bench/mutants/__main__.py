"""How many small mistakes the tests notice: `make mutants`, configured by `[tool.mutants]` in pyproject.toml.

A fixed random sample of small changes is made to the packages, one at a time, in copies of the project. For each, the
tests that run the changed line run, the quickest first, until one fails. What no test notices is printed as it was and
as it is, to be looked at: a test is missing, or the change changes nothing and belongs into `equivalent_mutants.toml`
with the reason.

A package's score is the share of changes that a test noticed. Tests that fail without any change are told and left out.
"""

import argparse
import ast
import os
import queue
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

from bench.mutants import plugin
from bench.mutants.candidates import Candidate, Change, applied, candidates, sample
from bench.mutants.trial import Ran, Reach, copy_of, reach, run

ROOT = Path(__file__).resolve().parents[2]
WHOLE_SUITE = 1800.0
"""Time limit of a run of all tests [s]."""
SPARE, TIMES = 20.0, 6.0
"""A test may last this much longer [s] and this many times as long as without a change."""
START_UP = 60.0
"""Time for imports and collection [s]."""
SURVIVED = "survived"
EQUIVALENT = "equivalent"


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


def main() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mutants"]
    options = _options(settings)
    began = time.monotonic()
    chosen = _chosen(options.files or settings["packages"], settings["leave_alone"], options.per_package, options.seed)
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        folders = [copy_of(ROOT, Path(name) / f"copy-{number}") for number in range(max(2, options.jobs))]
        with ThreadPoolExecutor(options.jobs) as pool:  # one run for the times, one for the lines
            whole = {"at": options.tests, "seconds": WHOLE_SUITE, "first": False}
            timing = pool.submit(run, folders[0], {}, **whole)
            tracing = pool.submit(run, folders[1], {}, **whole, cover=True)
            plain, covered = timing.result(), tracing.result()
        seconds = _usable(plain, covered)
        reached = reach(folders[1])
        print(f"{len(seconds)} tests pass unchanged; {time.monotonic() - began:.0f} s so far", flush=True)
        unchanged = [replace(candidate, mutated=candidate.node) for candidate in chosen]
        made = unchanged if options.unchanged else chosen
        results = _all(made, _equivalents(), reached, seconds, folders[: options.jobs])
    report = _report(results, time.monotonic() - began)
    print(report)
    if options.out:
        options.out.write_text(report + "\n", encoding="utf-8")


def _options(settings: Mapping[str, object]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench.mutants", description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="*", help="packages or files to change (default: all packages)")
    parser.add_argument("--tests", nargs="*", default=[], help="files or folders of tests (default: all)")
    parser.add_argument(
        "--per-package", type=int, default=settings["per_package"], help="mutants (default %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=settings["seed"], help="of the sample (default %(default)s)")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default %(default)s)")
    parser.add_argument(
        "--unchanged", action="store_true", help="make no change: whatever is noticed is the tool's fault"
    )
    parser.add_argument("--out", type=Path, help="write the report here too")
    return parser.parse_args()


def _chosen(places: Sequence[str], leave_alone: Sequence[str], count: int, seed: int) -> list[Candidate]:
    """The sample, packages in turns."""
    samples: list[list[Candidate]] = []
    for place in places:
        whole = ROOT / place
        files = [whole] if whole.suffix else sorted(whole.rglob("*.py"))
        found = [c for file in files for c in candidates(ROOT, file.relative_to(ROOT).as_posix(), leave_alone)]
        samples.append(sample(found, count=count, seed=seed))
    return [line[k] for k in range(count) for line in samples if k < len(line)]


def _usable(plain: Ran, covered: Ran) -> dict[str, float]:
    """Seconds of every test that passes as things are."""
    if not plain.seconds or not covered.seconds:
        sys.exit(f"the tests do not run unchanged:\n{plain.said[-3000:]}\n{covered.said[-3000:]}")
    for test, why in plain.failed.items():
        print(f"fails without a change, left out: {test}: {why}")
    for test, why in covered.failed.items():
        print(f"fails while lines are traced; what it ran until then counts: {test}: {why}")
    return {test: seconds for test, seconds in plain.seconds.items() if test not in plain.failed}


def _equivalents() -> dict[tuple[str, str, str], str]:
    """Reasons by file, lines as they are and lines as they become."""
    entries = tomllib.loads((ROOT / "tests" / "equivalent_mutants.toml").read_text(encoding="utf-8"))["equivalent"]
    return {(entry["file"], entry["was"].strip(), entry["now"].strip()): entry["reason"] for entry in entries}


def _all(
    chosen: Sequence[Candidate],
    equivalents: Mapping[tuple[str, str, str], str],
    reached: Reach,
    seconds: Mapping[str, float],
    folders: Sequence[Path],
) -> list[Result]:
    free: queue.SimpleQueue[Path] = queue.SimpleQueue()
    for folder in folders:
        free.put(folder)

    def one(candidate: Candidate) -> Result:
        change = applied(candidate)
        reason = equivalents.get((candidate.path, "\n".join(change.was), "\n".join(change.now)))
        if reason is not None:
            return Result(candidate, change, EQUIVALENT, reason, 0, 0.0)
        folder = free.get()
        try:
            return _tried(candidate, change, _tests(candidate, reached, seconds), seconds, folder)
        finally:
            free.put(folder)

    results: list[Result] = []
    with ThreadPoolExecutor(len(folders)) as pool:
        try:
            for future in as_completed([pool.submit(one, candidate) for candidate in chosen]):
                results.append(result := future.result())
                print(
                    f"{len(results):4}/{len(chosen)} {result.seconds:5.1f} s  {_place(result)} {result.by[:90]}",
                    flush=True,
                )
        finally:
            pool.shutdown(wait=False, cancel_futures=True)  # Ctrl-C ends the run, not one mutant
    return sorted(results, key=lambda r: (r.candidate.path, r.candidate.line))


def _tests(candidate: Candidate, reached: Reach, seconds: Mapping[str, float]) -> list[str]:
    """Tests that run the line: those of its own module first, then the quickest.

    What runs at import has no tests of its own: those of the file count, and of the files that import it.
    """
    tests = reached.of(candidate.path, *candidate.statement)
    if candidate.at_import:
        tests |= reached.anywhere([candidate.path, *_importers(candidate.path)])
    path = Path(candidate.path)
    own = (f"tests/{path.parts[0]}/test_{path.stem}.py::", f"{candidate.path}::")
    return sorted(tests & seconds.keys(), key=lambda test: (not test.startswith(own), seconds[test]))


def _importers(path: str) -> list[str]:
    module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    found: list[str] = []
    for package in {path.partition("/")[0], "sim", "scenarios"}:
        for file in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or "", *(f"{node.module}.{a.name}" for a in node.names)]
                if module in names:
                    found.append(file.relative_to(ROOT).as_posix())
    return found


def _tried(
    candidate: Candidate, change: Change, tests: Sequence[str], seconds: Mapping[str, float], folder: Path
) -> Result:
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
        ran = run(folder, limits, seconds=whole, first=True)
    finally:
        file.write_bytes(original)
        os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    outcome, by = _outcome(ran)
    return Result(candidate, change, outcome, by, len(tests), time.monotonic() - began)


def _outcome(ran: Ran) -> tuple[str, str]:
    by = next((f"{test}: {why}" for test, why in ran.failed.items()), ran.said.strip()[-200:])
    match ran.status:
        case 0:
            return SURVIVED, ""
        case None | plugin.TOO_LONG:
            return "too long", by
        case 1:
            return "killed", by
        case 2 | 3:
            return "no import", by
        case status if status < 0:
            return "crashed", by
        case status:
            raise RuntimeError(f"pytest ended with status {status}: {ran.said[-2000:]}")


def _place(result: Result) -> str:
    return f"{result.candidate.path}:{result.candidate.line}: {result.outcome}"


def _report(results: Sequence[Result], seconds: float) -> str:
    lines: list[str] = []
    for result in results:
        if result.outcome in (SURVIVED, EQUIVALENT):
            lines += ["", f"{_place(result)}, {result.by or f'{result.tests} tests run it'}"]
            lines += [f"  - {line}" for line in result.change.was] + [f"  + {line}" for line in result.change.now]
    lines += ["", f"{'package':12} {'killed':>7} {'of':>5} {'score':>7}   survived  equivalent"]
    for package in sorted({result.package for result in results}):
        outcomes = [result.outcome for result in results if result.package == package]
        survived, equivalent = outcomes.count(SURVIVED), outcomes.count(EQUIVALENT)
        total = len(outcomes) - equivalent
        score = f"{(total - survived) / total:7.1%}" if total else "      -"
        lines.append(f"{package:12} {total - survived:7} {total:5} {score} {survived:10} {equivalent:11}")
    lines.append(f"{len(results)} mutants in {seconds / 60.0:.1f} minutes")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
