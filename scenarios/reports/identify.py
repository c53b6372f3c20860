"""What `rx90 identify` says: the gains, how far to trust them, why some are refused."""

from collections.abc import Sequence

from ident.gains import GainEstimate, JointGain
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, number, percent
from scenarios.reports.gains import INTERVAL, interval, note_paragraphs, reason_paragraph
from scenarios.store.documents import estimate_document, gain_parts

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Gain", unit="N m/unit"),
    *INTERVAL,
    Column(title="Unexplained", unit="% of rms"),
    Column(title="Verdict", words=True),
)


def estimate_report(estimate: GainEstimate, notes: Sequence[str], identify_s: float) -> Report:
    """The table of identified gains, the reasons for refusals, and how good the fit is.

    Args:
        estimate: From identification.
        notes: On what was done to the recordings.
        identify_s: Wall time [s].
    """
    rows = tuple(_row(number, joint) for number, joint in enumerate(estimate.joints, 1))
    parts: list[Part] = [Table(columns=COLUMNS, rows=rows), *note_paragraphs(notes)]
    parts += [reason_paragraph(k, joint.reason) for k, joint in enumerate(estimate.joints, 1) if joint.reason]
    found = int(estimate.identifiable.sum())
    parts.append(
        Paragraph(
            f"{found} of {len(estimate.joints)} gains identified from {estimate.rows} rows, "
            f"relative residual {100.0 * estimate.rel_error_norm:.2f} %.",
            strong=True,
        )
    )
    return Report(f"Drive gains by {estimate.method}", tuple(parts), estimate_document(estimate, notes, identify_s))


def _row(index: int, joint: JointGain) -> tuple[Cell, ...]:
    parts = gain_parts(joint)
    return cells(
        str(index),
        joint.joint,
        number(parts and parts.value, ".4f"),
        *interval(joint),
        percent(joint.error_norm / joint.current_norm if joint.rows else None, ".1f"),
        Cell("refused", Mood.DOUBTFUL) if parts is None else Cell("identified", Mood.GOOD),
    )
