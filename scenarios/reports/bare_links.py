"""What `rx90 identify` says of links that bodies can have."""

from ident.support.arrays import Array
from scenarios.gains_in_use.model_update.link_values import FAR
from scenarios.reports.content import Column, Mood, Paragraph, Part, Table, cells
from scenarios.results.models.links import Links

COLUMNS = (
    Column(title="Joint"),
    Column(title="Mass", unit="kg"),
    Column(title="Centre", unit="m", words=True),
    Column(title="ixx iyy izz ixy ixz iyz", unit="kg m^2", words=True),
)


def links_parts(links: Links | None, reason: str | None, revolute: Array) -> list[Part]:
    """The set as a table, and how far data had to give way; why there is none.

    Args:
        links: The set, None where there is none.
        reason: Why there is none.
        revolute: Whether each joint turns, shape (n,).
    """
    if links is None:
        return [Paragraph(f"No parameters of single links: {reason}.")]
    rows = tuple(
        cells(
            str(each.joint),
            f"{each.mass:.4g}",
            " ".join(f"{x:.4f}" for x in each.com),
            " ".join(f"{x:.4g}" for x in each.inertia.six),
            f"{each.motor_inertia:.4g}",
        )
        for each in links.links
    )
    unit = "kg m^2" if revolute.all() else "kg" if not revolute.any() else "kg (m^2)"
    title = "Links as bodies, in SI, each in the frame of its joint"
    far = links.farthest_deviations
    words = (
        "Data determine only base parameters. Of all physically consistent links with these, those nearest to "
        f"the model are shown. {links.farthest_parameter} changed most, by {far:.2g} standard deviations."
    )
    doubt = "" if far <= FAR else (" This is too large: check the model, the gains and the data.")
    return [
        Table(title=title, columns=(*COLUMNS, Column(title="Motor", unit=unit)), rows=rows),
        Paragraph(words + doubt, Mood.DOUBTFUL if doubt else Mood.PLAIN),
    ]
