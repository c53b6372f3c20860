"""Report of `rx90 identify`: gains, their intervals, reasons for refusals."""

from collections.abc import Sequence

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import SPOILS, Severity
from ident.identification import Identification, refused_for_faults
from ident.model.arm import Arm
from ident.payload_identification.gains_outcome import GainsOutcome
from ident.support.arrays import Array
from ident.unseen import Unseen
from scenarios.reports.content import Cell, Mood, Paragraph, Part, Report, Table, column, percent, rounded, table
from scenarios.reports.cost import cost_parts
from scenarios.reports.diagnoses import horizon_paragraphs
from scenarios.reports.gains import (
    gain_unit,
    interval_columns,
    joints_named,
    note_paragraphs,
    payload_tables,
    reason_paragraph,
)
from scenarios.reports.unseen import unseen_parts, unseen_verdict
from scenarios.results.models.gains import ResultGain
from scenarios.results.models.run import Result


def estimate_report(
    found: Identification,
    arm: Arm,
    identify_s: float,
    a_priori: GainsOutcome | None = None,
    unseen: Unseen | None = None,
) -> Report:
    """Return the report: number of gains, quality of the fit, table, reasons for refusals; `identify_s` is in s."""
    result, estimate = Result.of_identification(found, identify_s, a_priori, unseen), found.estimate
    shares = [estimate.residual_share(index) for index in range(len(estimate.joints))]
    parts: list[Part] = [
        summary(result),
        *unseen_verdict(result.unseen),
        identified_table(result.gains, shares, arm.revolute),
    ]
    parts += note_paragraphs(result.notes, found.found, arm.revolute)
    parts += horizon_paragraphs(found.found)
    parts += [reason_paragraph(gain.joint, gain.reason) for gain in result.gains if gain.reason is not None]
    parts += kept_paragraphs(result)
    parts += payload_tables(result.payload)
    parts += unseen_parts(result.unseen)
    parts += cost_parts(result.cost, arm.revolute)
    return Report(f"Drive gains by {estimate.method}", tuple(parts), result.model_dump(mode="json"))


def identified_table(gains: Sequence[ResultGain], unexplained: Sequence[float | None], revolute: Array) -> Table:
    """Return the table of identified gains.

    `unexplained` is the norm of each joint's residual over that of its currents, None without rows; `revolute`, shape
    (n,), states which joints are revolute.
    """
    left = {gain.joint: share for gain, share in zip(gains, unexplained, strict=True)}
    found, refused = Cell("identified", Mood.GOOD), Cell("refused", Mood.DOUBTFUL)
    return table(
        gains,
        column("Joint", lambda gain: gain.joint),
        column("Name", lambda gain: gain.name or "", words=True),
        column(f"Gain [{gain_unit(revolute)}]", lambda gain: rounded(gain.estimate, gain.std and 2.0 * gain.std)),
        *interval_columns(),
        column("Residual [% of rms]", lambda gain: percent(left[gain.joint], ".1f")),
        column("Verdict", lambda gain: found if gain.identifiable else refused, words=True),
    )


def summary(result: Result) -> Paragraph:
    """Return a sentence on the number of gains, the quality of the fit, and gains refused because of a fault."""
    fit, many = result.fit, sum(gain.identifiable for gain in result.gains)
    said = (
        f"{many} of {len(result.gains)} gains identified from {fit.rows} rows, "
        f"relative residual {100.0 * fit.rel_error_norm:.2f} %"
    )
    lost = refused_for_faults(result.found.diagnoses)
    if not lost:
        return Paragraph(f"{said}.", strong=True)
    which = joints_named([joint + 1 for joint in lost])
    return Paragraph(f"{said}; {which} refused because of a fault of the logs.", Mood.BAD, strong=True)


def kept_paragraphs(result: Result) -> list[Paragraph]:
    """Return gains that a fault changes by less than the limit: each joint once, with the largest effect."""
    largest = dict[int, float]()
    for wrong in result.found.diagnoses:
        for each in wrong.effects if wrong.severity is Severity.WRONG else ():
            if each.matters and result.gains[each.joint].identifiable:
                largest[each.joint] = max(largest.get(each.joint, 0.0), each.percent, key=abs)
    moved = [f"joint {joint + 1} by {two_digits(largest[joint], sign='+')} %" for joint in sorted(largest)]
    told = f"Gains kept although a fault changes them, by less than {SPOILS:g} standard deviations: {', '.join(moved)}."
    return [Paragraph(told, Mood.DOUBTFUL)] if moved else []
