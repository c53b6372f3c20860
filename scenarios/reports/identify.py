"""What `rx90 identify` says: the gains, how far to trust them, why some are refused."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import SPOILS, Diagnosed, Severity
from ident.estimation.estimate import IdentifiedGain, JointResult, RefusedGain
from ident.identification import Identification, refused_for_faults
from ident.model.arm import Arm
from ident.support.arrays import Array
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.diagnoses import horizon_paragraphs
from scenarios.reports.gains import INTERVAL, gain_unit, interval, note_paragraphs, payload_tables, reason_paragraph
from scenarios.results.documents import estimate_document


def estimate_report(found: Identification, arm: Arm, identify_s: float) -> Report:
    """The table of identified gains, the reasons for refusals, and how good the fit is.

    Args:
        found: Gains and notes.
        arm: Whose gains they are.
        identify_s: Wall time [s].
    """
    estimate = found.estimate
    shares = [estimate.residual_share(index) for index in range(len(estimate.joints))]
    parts: list[Part] = [identified_table(estimate.joints, shares, arm.revolute)]
    parts += note_paragraphs(found.notes, found.found, arm.revolute)
    parts += horizon_paragraphs(found.found)
    refused = [(k, joint) for k, joint in enumerate(estimate.joints, 1) if isinstance(joint, RefusedGain)]
    parts += [reason_paragraph(k, joint.reason) for k, joint in refused]
    parts += kept_paragraphs(estimate.joints, found.found)
    parts += payload_tables(estimate.payload)
    parts.append(summary(estimate.joints, estimate.rows, estimate.rel_error_norm, found.found))
    return Report(f"Drive gains by {estimate.method}", tuple(parts), estimate_document(found, identify_s))


def identified_table(joints: Sequence[JointResult], unexplained: Sequence[float | None], revolute: Array) -> Table:
    """Identified gains.

    Args:
        joints: One a joint.
        unexplained: Norm of each joint's residual over that of its currents, None where it has no row.
        revolute: Whether each joint turns, shape (n,).
    """
    columns = (
        Column(title="Joint"),
        Column(title="Name", words=True),
        Column(title="Gain", unit=gain_unit(revolute)),
        *INTERVAL,
        Column(title="Unexplained", unit="% of rms"),
        Column(title="Verdict", words=True),
    )
    rows = (_row(k, *pair) for k, pair in enumerate(zip(joints, unexplained, strict=True), 1))
    return Table(columns=columns, rows=tuple(rows))


def summary(joints: Sequence[JointResult], rows: int, rel_error_norm: float, found: Diagnosed) -> Paragraph:
    """How many gains there are, how good the fit is, and which gains a fault costs, in a sentence."""
    many = sum(isinstance(joint, IdentifiedGain) for joint in joints)
    said = (
        f"{many} of {len(joints)} gains identified from {rows} rows, relative residual {100.0 * rel_error_norm:.2f} %"
    )
    lost = [str(j + 1) for j in refused_for_faults(found.diagnoses)]
    if not lost:
        return Paragraph(f"{said}.", strong=True)
    which = f"joint{'s' if lost[1:] else ''} {', '.join(lost)}"
    return Paragraph(f"{said}; refused for a fault of the logs: {which}.", Mood.BAD, strong=True)


def kept_paragraphs(joints: Sequence[JointResult], found: Diagnosed) -> list[Paragraph]:
    """Gains that are kept beside a fault, and that it moves by less than would refuse them."""
    moved = [
        f"joint {each.joint + 1} by {two_digits(each.percent, sign='+')} %"
        for wrong in found.diagnoses
        if wrong.severity is Severity.WRONG
        for each in wrong.effects
        if each.matters and isinstance(joints[each.joint], IdentifiedGain)
    ]
    told = f"Kept, moved by less than {SPOILS:g} standard deviations: {', '.join(moved)}."
    return [Paragraph(told, Mood.DOUBTFUL)] if moved else []


def _row(number: int, joint: JointResult, unexplained: float | None) -> tuple[Cell, ...]:
    given = isinstance(joint, IdentifiedGain)
    return cells(
        str(number),
        joint.joint,
        f"{joint.value:.4f}" if given else NONE,
        *interval(joint),
        percent(unexplained, ".1f"),
        Cell("identified", Mood.GOOD) if given else Cell("refused", Mood.DOUBTFUL),
    )
