"""How many small mistakes the tests notice: `make mutants`, configured by `[tool.mutants]` in pyproject.toml.

A fixed random sample of small changes is made to the packages, one at a time, in copies of the project. For each, the
tests that run the changed line run, the quickest first, until one fails. What no test notices is printed as it was and
as it is, to be looked at: a test is missing, or the change changes nothing and belongs into `equivalent_mutants.toml`
with the reason.

A package's score is the share of changes that a test noticed. Tests that fail without any change are told and left out.
"""

import argparse
import queue
import signal
import sys
import tempfile
import time
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from bench.mutants.candidates import Candidate, applied, candidates, sample
from bench.mutants.outcome import EQUIVALENT, SURVIVED, Result, tests_of, tried
from bench.mutants.report import Known, change_of, equivalents, outdated, place, report
from bench.mutants.trial import NO_TESTS, Reach, copy_of, ended, trace

ROOT = Path(__file__).resolve().parents[2]
EQUIVALENTS = "tests/equivalent_mutants.toml"
WHOLE_SUITE = 5400.0
"""Time limit of a run of all tests [s]."""


def main() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mutants"]
    options = _options(settings)
    began = time.monotonic()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C
    places = options.files or settings["packages"]
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        folders = [copy_of(ROOT, Path(name) / f"copy-{number}") for number in range(options.jobs)]
        chosen = _chosen(folders[0], places, settings["leave_alone"], options.per_package, options.seed)
        known = equivalents(folders[0] / EQUIVALENTS)
        for line in outdated(known, folders[0]):
            print(line)
        seconds, reached = _unchanged(folders, options.tests)
        print(f"{len(seconds)} tests pass unchanged; {time.monotonic() - began:.0f} s so far", flush=True)
        unchanged = [replace(candidate, mutated=candidate.node) for candidate in chosen]
        made = unchanged if options.unchanged else chosen
        results = _all(made, known, reached, seconds, folders)
    said = report(results, time.monotonic() - began)
    print(said)
    if options.out:
        options.out.write_text(said + "\n", encoding="utf-8")


def _options(settings: Mapping[str, object]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench.mutants", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("files", nargs="*", help="packages or files to change (default: all packages)")
    parser.add_argument(
        "--tests", nargs="*", default=settings["tests"], help="files or folders of tests (default %(default)s)"
    )
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


def _chosen(root: Path, places: Sequence[str], leave_alone: Sequence[str], count: int, seed: int) -> list[Candidate]:
    """The sample, packages in turns."""
    samples: list[list[Candidate]] = []
    for name in places:
        whole = root / name
        files = [whole] if whole.suffix else sorted(whole.rglob("*.py"))
        found = [c for file in files for c in candidates(root, file.relative_to(root).as_posix(), leave_alone)]
        samples.append(sample(found, count=count, seed=seed))
    return [line[k] for k in range(count) for line in samples if k < len(line)]


def _unchanged(folders: Sequence[Path], at: Sequence[str]) -> tuple[dict[str, float], Reach]:
    """Seconds of every test that passes as things are, and the lines it runs."""
    seconds: dict[str, float] = {}
    reached = Reach({})
    with ThreadPoolExecutor(len(folders)) as pool:
        shares = [
            pool.submit(trace, folder, at, share=(k, len(folders)), seconds=WHOLE_SUITE)
            for k, folder in enumerate(folders)
        ]
        for ran, lines in (share.result() for share in shares):
            if ran.status == NO_TESTS and len(folders) > 1:  # fewer tests than copies
                continue
            if not ran.seconds:
                sys.exit(f"the tests do not run unchanged: {ended(ran.status, WHOLE_SUITE)}\n{ran.said[-3000:]}")
            for test, why in ran.failed.items():
                print(f"fails without a change, left out: {test}: {why}")
            seconds |= {test: time for test, time in ran.seconds.items() if test not in ran.failed}
            reached |= lines
    if not seconds:
        sys.exit(f"no test of {' '.join(at)} passes unchanged")
    return seconds, reached


def _all(
    chosen: Sequence[Candidate],
    known: Known,
    reached: Reach,
    seconds: Mapping[str, float],
    folders: Sequence[Path],
) -> list[Result]:
    free: queue.SimpleQueue[Path] = queue.SimpleQueue()
    for folder in folders:
        free.put(folder)

    def one(candidate: Candidate) -> Result:
        change = applied(candidate)
        reason = known.get((candidate.path, "\n".join(change.was), "\n".join(change.now)))
        if reason is not None:
            return Result(candidate, change, EQUIVALENT, reason, 0, 0.0)
        folder = free.get()
        try:
            return tried(candidate, change, tests_of(candidate, folder, reached, seconds), seconds, folder)
        finally:
            free.put(folder)

    results: list[Result] = []
    with ThreadPoolExecutor(len(folders)) as pool, suppress(KeyboardInterrupt):  # what was tried is reported
        try:
            for future in as_completed([pool.submit(one, candidate) for candidate in chosen]):
                results.append(result := future.result())
                print(
                    f"{len(results):4}/{len(chosen)} {result.seconds:5.1f} s  {place(result)} {result.by[:90]}",
                    *(change_of(result) if result.outcome == SURVIVED else ()),
                    sep="\n",
                    flush=True,
                )
        finally:
            pool.shutdown(wait=False, cancel_futures=True)  # Ctrl-C ends the run, not one mutant
    return sorted(results, key=lambda r: (r.candidate.path, r.candidate.line))


if __name__ == "__main__":
    main()
