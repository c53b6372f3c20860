"""What `rx90 patch` says: every attribute that was changed, and what was unchanged."""

from scenarios.gains_in_use.results import Patched
from scenarios.reports.content import NONE, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.gains import sentence
from scenarios.reports.unseen import unseen_parts, unseen_verdict

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
    "Efforts are scaled like the gains. Damping and friction are the joint's viscous and Coulomb friction [N "
    "m s/rad, N m; N s/m, N], without offsets and load-dependent friction; armature [kg m^2; kg]. Links, with "
    "--links, are the physically consistent ones nearest to the model that have the identified base "
    "parameters. Nothing else is changed."
)


def patch_report(written: Patched) -> Report:
    """What was written."""
    changed = [each for each in written.changes if each.after is not None]
    left = [each for each in written.changes if each.after is None]
    done = "" if written.written else " NOT WRITTEN: it predicts no better than the model; --force writes it."
    words = f"{written.out}: {len(changed)} attributes changed, {len(left)} unchanged.{done}"
    mood = Mood.BAD if done else Mood.PLAIN if changed else Mood.DOUBTFUL
    parts: list[Part] = [*unseen_verdict(written.unseen, this="the copy", other="the model as it is")]
    parts.append(Paragraph(words, mood, strong=True))
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
        parts.append(Table(title="Unchanged", columns=LEFT, rows=rows))
    parts += unseen_parts(written.unseen, other="model")
    parts += [Paragraph(NOTES), *(Paragraph(sentence(f"Note: {note}")) for note in written.notes)]
    if written.ros_params is not None and written.written:
        parts.append(Paragraph(f"{written.ros_params}: torque constants as ROS 2 parameters."))
    return Report("Patched model", tuple(parts), written.model_dump(mode="json"))
