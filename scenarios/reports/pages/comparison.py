"""The page of a comparison: best methods, errors and coverage by joint, tables."""

import json
from pathlib import Path

from ident.support.naming import one_line
from scenarios.benchmark.comparison.statistics import ComparedScenario, Comparison
from scenarios.rendering.content import Heading, Part, Report
from scenarios.rendering.plot import TONES, Axis, Mark, Plot, Reference, Series, intervals, values
from scenarios.reports.comparison import comparison_report
from scenarios.results import provenance
from scenarios.results.monte_carlo import NORMAL, in_percent
from scenarios.support.errors import ScenarioError

DOCUMENT = "report.json"


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If its document is damaged, or of another version.
    """
    path = folder / DOCUMENT
    try:
        found = Comparison.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:  # of pydantic too
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ScenarioError(f"{one_line(path)}: damaged, or written by another version of rx90: {first}") from error
    compared, about = found.scenarios, found.about
    if not compared or not all(each.methods for each in compared):
        raise ScenarioError(f"{one_line(path)}: compares nothing")
    told = comparison_report(found)
    drawn = map(plots, compared)
    parts: list[Part] = []
    for part in told.parts[: len(told.parts) - len(about)]:
        parts.append(part)
        if isinstance(part, Heading):
            parts += next(drawn)  # a scenario each
    others = {key: text for key, text in about.items() if key != "Command"}
    parts += provenance.repeated({"Original command": about.get("Command", "")}, others, {})
    return Report(told.title, tuple(parts), told.document)


def plots(compared: ComparedScenario) -> list[Part]:
    """Errors and coverage of the best methods by joint."""
    best = compared.methods[: len(TONES)]
    names = tuple(str(joint.joint) for joint in best[0].joints)
    others = len(compared.methods) - len(best)
    left = f" {others} more in the table only." if others else ""
    rms, held = list[Series](), list[Series]()
    for method, tone in zip(best, TONES, strict=False):
        there = [(str(joint.joint), joint.rms) for joint in method.joints if joint.rms is not None]
        rms.append(
            Series(
                label=method.method,
                mark=Mark.BARS,
                tone=tone,
                x=tuple(name for name, _ in there),
                y=values([100.0 * size for _, size in there]),
            )
        )
        covered = [(str(joint.joint), joint.cover_2) for joint in method.joints if joint.cover_2 is not None]
        held.append(
            intervals(method.method, [name for name, _ in covered], [in_percent(each) for _, each in covered], tone)
        )
    joint = Axis(title="joint", categories=names)
    return [
        Plot(
            title="Rms error",
            caption=f"Gains that each method gave; no bar where it gave none.{left}",
            x=joint,
            y=Axis(title="rms error", unit="%", zero=True),
            series=tuple(rms),
        ),
        Plot(
            title="Coverage of two estimated standard deviations",
            caption=f"Bars: 95 % intervals. Dashed: {100.0 * NORMAL:.1f} %, the nominal coverage.{left}",
            x=joint,
            y=Axis(title="held", unit="% of gains"),
            series=tuple(held),
            references=(Reference("", 100.0 * NORMAL),),
        ),
    ]
