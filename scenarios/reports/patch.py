"""What `rx90 patch` says: every attribute that was changed, and what was left alone."""

from scenarios.gains_in_use.results import Patched
from scenarios.reports.content import NONE, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.gains import sentence

COLUMNS = (
    Column(title="Joint", words=True),
    Column(title="Attribute", words=True),
    Column(title="Before"),
    Column(title="After"),
    Column(title="2 sigma", unit="%"),
)
LEFT = (
    Column(title="Joint", words=True),
    Column(title="Attribute", words=True),
    Column(title="Stays"),
    Column(title="Why", words=True),
)
NOTES = (
    "Efforts are scaled like the gains; damping and friction are the viscous and Coulomb friction of the "
    "joint's own law, in N m s/rad and N m (N s/m and N), offsets and friction that grows with load left "
    "out; armature in kg m^2 (kg). Links, where asked for, are bodies nearest to the model's of all with "
    "the base parameters that data determine. Nothing else in the file is changed."
)


def patch_report(written: Patched) -> Report:
    """What was written."""
    changed = [each for each in written.changes if each.after is not None]
    left = [each for each in written.changes if each.after is None]
    parts: list[Part] = []
    if changed:
        rows = tuple(
            cells(
                each.joint,
                each.attribute,
                each.before or NONE,
                each.after or NONE,
                percent(None if each.rel_std is None else 2.0 * each.rel_std, ".2g"),
            )
            for each in changed
        )
        parts.append(Table(title="Changed", columns=COLUMNS, rows=rows))
    if left:
        rows = tuple(cells(each.joint, each.attribute, each.before or NONE, each.reason) for each in left)
        parts.append(Table(title="Left alone", columns=LEFT, rows=rows))
    parts += [Paragraph(NOTES), *(Paragraph(sentence(f"Note: {note}")) for note in written.notes)]
    words = f"{written.out}: {len(changed)} attributes changed, {len(left)} left alone."
    parts.append(Paragraph(words, Mood.PLAIN if changed else Mood.DOUBTFUL, strong=True))
    if written.ros_params is not None:
        parts.append(Paragraph(f"{written.ros_params}: torque constants as ROS 2 parameters."))
    return Report("Patched model", tuple(parts), written.model_dump(mode="json"))
