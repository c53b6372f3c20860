"""What is said in the end: every mutant that no test noticed, and each package's score."""

import tomllib
from collections.abc import Sequence
from pathlib import Path

from bench.mutants.outcome import EQUIVALENT, SURVIVED, TOO_LONG, Result

Known = dict[tuple[str, str, str], str]
"""Reasons by file, lines as they are and lines as they become."""


def equivalents(file: Path) -> Known:
    """Changes that are known to change nothing."""
    entries = tomllib.loads(file.read_text(encoding="utf-8")).get("equivalent", [])
    return {(entry["file"], _stripped(entry["was"]), _stripped(entry["now"])): entry["reason"] for entry in entries}


def outdated(known: Known, root: Path) -> list[str]:
    """What is said of the equivalents whose lines are no longer in the code."""
    said: list[str] = []
    for name, was, _ in known:
        file = root / name
        if not file.is_file() or was not in _stripped(file.read_text(encoding="utf-8")):
            said.append(f"listed as equivalent, no longer in {name}: {was}")
    return said


def _stripped(lines: str) -> str:
    return "\n".join(line.strip() for line in lines.strip().splitlines())


def place(result: Result) -> str:
    """Where a mutant is and what became of it."""
    return f"{result.candidate.path}:{result.candidate.line}: {result.outcome}"


def change_of(result: Result) -> list[str]:
    """The lines as they were and as they are."""
    return [f"  - {line}" for line in result.change.was] + [f"  + {line}" for line in result.change.now]


def report(results: Sequence[Result], seconds: float) -> str:
    """Survivors, as they were and as they are, and the scores."""
    lines: list[str] = []
    for result in results:
        if result.outcome in (SURVIVED, EQUIVALENT):
            lines += ["", f"{place(result)}, {result.by or f'{result.tests} tests run it'}"]
            lines += change_of(result)
    lines += ["", f"{'package':12} {'killed':>7} {'of':>5} {'score':>7}   survived  equivalent   too long"]
    for package in sorted({result.package for result in results}):
        outcomes = [result.outcome for result in results if result.package == package]
        survived, equivalent, slow = (outcomes.count(what) for what in (SURVIVED, EQUIVALENT, TOO_LONG))
        total = len(outcomes) - equivalent
        score = f"{(total - survived) / total:7.1%}" if total else "      -"
        lines.append(f"{package:12} {total - survived:7} {total:5} {score} {survived:10} {equivalent:11} {slow:10}")
    lines.append(f"{len(results)} mutants in {seconds / 60.0:.1f} minutes")
    return "\n".join(lines)
