"""Pages of results: one file per kind, whose `page` makes a report with plots from a folder."""

import json
from importlib import import_module
from pathlib import Path

from ident.support.naming import one_line
from scenarios.rendering.content import Report
from scenarios.results.record import RECORD, RESULT
from scenarios.support.errors import ScenarioError

PAGES = {
    "run": "logs",
    "identification": "logs",
    "check": "logs",
    "bare": "logs",
    "monte-carlo": "scenarios.results.monte_carlo",
    "sensitivity": "scenarios.results.sensitivity",
    "comparison": "scenarios.benchmark.comparison",
    "paper": "scenarios.benchmark.paper_result",
}
"""Kinds of results and the modules of their pages."""
STUDY, COMPARISON, PAPER = "study.json", "report.json", "paper.json"
LEAVERS = "run, identify or check --save, or monte-carlo, sensitivity, compare or paper --out"


def page_of(folder: Path) -> Report:
    """Return the page of a result folder.

    Raises:
        ScenarioError: If it holds no result, or one of another version; if it is an unfinished study; if a file is
            missing or changed.
    """
    module = PAGES[kind_of(folder)]
    return import_module(module if "." in module else f"{__name__}.{module}").page(folder)


def kind_of(folder: Path) -> str:
    """Return the kind of a folder, a key of `PAGES`.

    Raises:
        ScenarioError: If it holds no result.
    """
    if not folder.is_dir():
        raise ScenarioError(f"{one_line(folder)}: not a folder; expected one written by {LEAVERS}")
    for name, key, kind in ((RECORD, "kind", None), (STUDY, "study", None), (COMPARISON, None, "comparison")):
        if (folder / name).is_file():
            return kind or _stated(folder / name, key or "")
    if (folder / PAPER).is_file():
        return "paper"
    if (folder / RESULT).is_file():
        raise ScenarioError(
            f"{one_line(folder)}: contains {RESULT} but no {RECORD}: incomplete or from an older version; save it again"
        )
    if (folder / "paper.md").is_file():
        raise ScenarioError(
            f"{one_line(folder)}: contains paper.md but no {PAPER}: incomplete or from an older version; write it again"
        )
    raise ScenarioError(f"{one_line(folder)}: contains no result; expected a folder written by {LEAVERS}")


def _stated(path: Path, key: str) -> str:
    """Return the kind that a file states."""
    try:
        stated = json.loads(path.read_text(encoding="utf-8"))[key]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ScenarioError(f"{one_line(path)}: damaged, or from another version: it states no {key!r}") from error
    if stated not in PAGES:
        raise ScenarioError(f"{one_line(path)}: states {key} {one_line(stated)!r}; known: {', '.join(PAGES)}")
    if stated == "comparison":
        raise ScenarioError(
            f"{one_line(path.parent)}: is one scenario of a comparison; give the folder that contains it"
        )
    return stated
