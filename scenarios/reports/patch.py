"""What `rx90 patch` says: every attribute that was changed, and what was left alone."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from scenarios.experiments.files.gains import GainsFile
from scenarios.gains_in_use.model_update.places import Change
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


def patch_report(changes: Sequence[Change], gains: GainsFile, out: Path, parameters: Path | None) -> Report:
    """What was written.

    Args:
        changes: Of the model.
        gains: That they were made with.
        out: The model that was written.
        parameters: The parameter file that was written, None for none.
    """
    changed = [each for each in changes if each.after is not None]
    left = [each for each in changes if each.after is None]
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
    parts += [Paragraph(NOTES), *(Paragraph(sentence(f"Note: {note}")) for note in gains.notes)]
    words = f"{out}: {len(changed)} attributes changed, {len(left)} left alone."
    parts.append(Paragraph(words, Mood.PLAIN if changed else Mood.DOUBTFUL, strong=True))
    if parameters is not None:
        parts.append(Paragraph(f"{parameters}: torque constants as ROS 2 parameters."))
    document = {
        "out": str(out),
        "ros_params": None if parameters is None else str(parameters),
        "changes": [asdict(each) for each in changes],
        "notes": list(gains.notes),
    }
    return Report("Patched model", tuple(parts), document)
