"""What the consistency tests of an estimate found, each with its statistic and what it looks at."""

from collections.abc import Sequence

from ident.consistency.finding import Finding
from scenarios.reports.content import Cell, Column, Heading, Mood, Paragraph, Part, Table, cells

LOOKS_AT = {
    "elasticity": "joints that yield, which no residual shows",
    "load friction": "friction that grows with the load, which no residual shows",
    "joints": "a joint's own currents against all joints together",
    "centre": "the payload's centre of mass against what is left",
    "halves": "the first half of every motion against the second",
    "bare": "motions with a bare flange against each other",
    "position": "what is left, against the joint's position",
    "speed": "what is left, against the joint's speed",
    "whiteness": "what is left, against itself in time",
    "own weight": "the arm's torque by its gains against that of the model's masses",
}
"""What a test compares, by its name in `ident.consistency.CHECKS` or its own module; one without words has its row."""
COLUMNS = (
    Column(title="Test", words=True),
    Column(title="Worst joint"),
    Column(title="Found"),
    Column(title="Limit"),
    Column(title="Of what", words=True),
    Column(title="Verdict", words=True),
)
SAID = "A test may be beyond its limit and quiet: what it finds moves no gain by what matters."


def consistency_parts(findings: Sequence[Finding]) -> list[Part]:
    """A table of the tests and what they compare, none where no test was made."""
    rows = tuple(
        cells(
            each.check,
            str(each.joint + 1),
            f"{each.statistic:.3g}",
            f"{each.threshold:.3g}",
            each.measure,
            Cell("speaks up", Mood.DOUBTFUL) if each.failed else Cell("quiet", Mood.GOOD),
        )
        for each in findings
    )
    if not rows:
        return []
    looks = "; ".join(f"{each.check}: {LOOKS_AT[each.check]}" for each in findings if each.check in LOOKS_AT)
    said = Paragraph(f"{SAID} What each looks at: {looks}." if looks else SAID)
    return [Heading("Consistency"), Table(columns=COLUMNS, rows=rows), said]
