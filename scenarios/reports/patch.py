"""Report of `rx90 patch`: changed and unchanged attributes."""

import re

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.plausibility import LARGE_RESIDUAL
from scenarios.gains_in_use.results import Patched
from scenarios.rendering.content import Mood, Paragraph, Part, Report, column, sentence, table, two_sigma
from scenarios.results.unseen import TOLD, unseen_parts, unseen_verdict

NOTES = (
    "Efforts are scaled like the gains. Damping and friction are the joint's viscous and Coulomb friction [N "
    "m s/rad, N m; N s/m, N], without offsets and load-dependent friction; armature [kg m^2; kg]. Links, with "
    "--links, are the physically consistent ones nearest to the model that have the identified base "
    "parameters. Nothing else is changed."
)

AS_GIVEN = "the model as it is"
"""Model with which the copy is compared if no data-sheet gains are given."""
COPY = (
    "Predictions use the copy as written. Offsets, and rotor inertia where the copy has none, are those of --arm; the "
    "table has their share of the currents, and three standard deviations of rotor inertia are allowed for."
)
LACKS = (
    "WARNING: the copy does not state rotor inertia and offsets of the currents, which are {} of the currents; --links "
    "writes rotor inertia."
)
AS_IT_IS = (
    "A copy with friction alone predicts better than the unchanged model, so this comparison does not test the gains. "
    "Give --nominal to compare them with the data-sheet gains."
)
DRAWN = (
    "The copy has the links of MODEL, so the gains are tested against the link masses in that file. To test them "
    "against a payload, give --links and a motion with a weighed payload."
)


def patch_report(written: Patched, other: str = AS_GIVEN) -> Report:
    """Return the report.

    Args:
        written: Changed and unchanged attributes.
        other: The model with which the copy was compared.
    """
    changed = [each for each in written.changes if each.after is not None]
    left = [each for each in written.changes if each.after is None]
    done = "" if written.written else " NOT WRITTEN: it does not pass; --force writes it."
    words = f"{written.out}: {len(changed)} attributes changed, {len(left)} unchanged.{done}"
    mood = Mood.BAD if done else Mood.PLAIN if changed else Mood.DOUBTFUL
    unseen = written.unseen
    passed = None if unseen is None else unseen.not_worse
    parts: list[Part] = [*unseen_verdict(unseen, this="the copy", other=other, passed=passed)]
    unstated = {each.joint: each.unstated_rel or 0.0 for each in (() if unseen is None else unseen.joints)}
    lacks = [f"{two_digits(100.0 * x)} % (joint {j})" for j, x in unstated.items() if x > LARGE_RESIDUAL]
    parts += [Paragraph(LACKS.format(", ".join(lacks)), Mood.DOUBTFUL, strong=True)] if lacks else []
    parts.append(Paragraph(words, mood, strong=True))
    if changed:
        parts.append(
            table(
                changed,
                column("Joint", lambda each: each.joint, words=True),
                column("Attribute", lambda each: each.attribute, words=True),
                column("Before", lambda each: _in_short(each.before), words=True),
                column("After", lambda each: _in_short(each.after), words=True),
                column("2 sigma [%]", lambda each: two_sigma(each.rel_std, ".2g")),
                title="Changed",
            )
        )
    if left:
        parts.append(
            table(
                left,
                column("Joint", lambda each: each.joint, words=True),
                column("Attribute", lambda each: each.attribute, words=True),
                column("Stays", lambda each: _in_short(each.before), words=True),
                column("Why", lambda each: each.reason, words=True),
                title="Unchanged",
            )
        )
    told = [COPY, *([] if unseen is None or unseen.fitted else [DRAWN]), TOLD]
    told += [AS_IT_IS] if other == AS_GIVEN else []
    parts += unseen_parts(unseen, other="rival", told=told)
    parts += [Paragraph(NOTES), *(Paragraph(sentence(f"Note: {note}")) for note in written.notes)]
    if written.ros_params is not None and written.written:
        parts.append(Paragraph(f"{written.ros_params}: torque constants as ROS 2 parameters."))
    return Report("Patched model", tuple(parts), written.model_dump(mode="json"))


def _in_short(value: str | None) -> str | None:
    """Return the numbers of an attribute in six digits; file and JSON have all."""
    return re.sub(r"-?\d+\.\d{6,}(e-?\d+)?", lambda found: f"{float(found[0]):.6g}", value) if value else None
