"""What `rx90 identify` says of what a payload would add to bare motions."""

from ident.model.arm import Arm
from scenarios.gains_in_use.bare import IfLoaded
from scenarios.reports.content import Column, Paragraph, Part, Table, cells, percent

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="2 sigma of its gain", unit="%"),
    Column(title="Verdict", words=True),
)


def if_loaded_parts(found: IfLoaded, arm: Arm) -> list[Part]:
    """What to expect of every gain."""
    rows = tuple(
        cells(
            str(each.joint + 1),
            arm.joint_names[each.joint],
            percent(None if each.rel_std is None else 2.0 * each.rel_std, ".2g"),
            "would be found" if each.reason is None else f"would be refused: {each.reason}",
        )
        for each in found.gains
    )
    title = f"If the same motions were repeated with the payload of {found.payload.mass:g} kg"
    words = "To be expected of noise and friction like these; friction that grows with the load may add to it."
    return [Table(title=title, columns=COLUMNS, rows=rows), Paragraph(words)]


def if_loaded_document(found: IfLoaded) -> dict[str, object]:
    """The same for programs."""
    return {
        "mass": found.payload.mass,
        "joints": [{"joint": each.joint + 1, "rel_std": each.rel_std, "reason": each.reason} for each in found.gains],
    }
