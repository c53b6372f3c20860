"""What `rx90 identify` says: the gains, how far to trust them, why some are refused."""

from ident.arm import Arm
from ident.estimate import GainEstimate, IdentifiedGain, JointResult, RefusedGain
from ident.identification import Identification
from scenarios.reports.content import NONE, Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.gains import INTERVAL, gain_unit, interval, note_paragraphs, payload_tables, reason_paragraph
from scenarios.store.documents import estimate_document


def estimate_report(found: Identification, arm: Arm, identify_s: float) -> Report:
    """The table of identified gains, the reasons for refusals, and how good the fit is.

    Args:
        found: Gains and notes.
        arm: Whose gains they are.
        identify_s: Wall time [s].
    """
    columns = (
        Column(title="Joint"),
        Column(title="Name", words=True),
        Column(title="Gain", unit=gain_unit(arm.revolute)),
        *INTERVAL,
        Column(title="Unexplained", unit="% of rms"),
        Column(title="Verdict", words=True),
    )
    estimate = found.estimate
    rows = tuple(_row(index, joint, estimate) for index, joint in enumerate(estimate.joints))
    parts: list[Part] = [Table(columns=columns, rows=rows), *note_paragraphs(found.notes, found.findings, arm.revolute)]
    refused = [(k, joint) for k, joint in enumerate(estimate.joints, 1) if isinstance(joint, RefusedGain)]
    parts += [reason_paragraph(k, joint.reason) for k, joint in refused]
    parts += payload_tables(estimate.payload)
    many = int(estimate.identifiable.sum())
    parts.append(
        Paragraph(
            f"{many} of {len(estimate.joints)} gains identified from {estimate.rows} rows, "
            f"relative residual {100.0 * estimate.rel_error_norm:.2f} %.",
            strong=True,
        )
    )
    return Report(f"Drive gains by {estimate.method}", tuple(parts), estimate_document(found, identify_s))


def _row(index: int, joint: JointResult, estimate: GainEstimate) -> tuple[Cell, ...]:
    given = isinstance(joint, IdentifiedGain)
    return cells(
        str(index + 1),
        joint.joint,
        f"{joint.value:.4f}" if given else NONE,
        *interval(joint),
        percent(estimate.residual_share(index), ".1f"),
        Cell("identified", Mood.GOOD) if given else Cell("refused", Mood.DOUBTFUL),
    )
