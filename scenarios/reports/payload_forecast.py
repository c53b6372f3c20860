"""What `rx90 identify` says of what a payload would add to bare motions."""

from collections.abc import Sequence

from scenarios.reports.content import VERDICT, Column, Paragraph, Part, Table, cells, percent
from scenarios.results.models.bare import ExpectedGains

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="2 sigma of gain", unit="%"),
    VERDICT,
)


def if_loaded_parts(found: ExpectedGains, names: Sequence[str]) -> list[Part]:
    """What to expect of every gain.

    Args:
        found: One a joint.
        names: Of the joints.
    """
    rows = tuple(
        cells(
            str(each.joint),
            name,
            percent(None if each.rel_std is None else 2.0 * each.rel_std, ".2g"),
            "would be identified" if each.reason is None else f"would be refused: {each.reason}",
        )
        for each, name in zip(found.joints, names, strict=True)
    )
    title = f"Forecast: the same motions repeated with the payload of {found.mass:g} kg"
    words = "The forecast assumes noise and friction as in these logs; load-dependent friction may increase it."
    return [Table(title=title, columns=COLUMNS, rows=rows), Paragraph(words)]
