"""What is said in the end: every mutant that no test noticed, and each package's score."""

import tomllib
from collections.abc import Sequence
from pathlib import Path

from bench.mutants.outcome import EQUIVALENT, SURVIVED, Result


def equivalents(file: Path) -> dict[tuple[str, str, str], str]:
    """Known changes that change nothing: reasons by file, lines as they are and lines as they become."""
    entries = tomllib.loads(file.read_text(encoding="utf-8"))["equivalent"]
    return {(entry["file"], entry["was"].strip(), entry["now"].strip()): entry["reason"] for entry in entries}


def place(result: Result) -> str:
    """Where a mutant is and what became of it."""
    return f"{result.candidate.path}:{result.candidate.line}: {result.outcome}"


def report(results: Sequence[Result], seconds: float) -> str:
    """Survivors, as they were and as they are, and the scores."""
    lines: list[str] = []
    for result in results:
        if result.outcome in (SURVIVED, EQUIVALENT):
            lines += ["", f"{place(result)}, {result.by or f'{result.tests} tests run it'}"]
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
