"""The page of a run or an identification: verdict, gains, refusals, torques, residuals, motion, consistency, origin."""

from dataclasses import replace
from pathlib import Path

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosed
from ident.model.arm import Arm
from ident.support.arrays import Array
from scenarios.reports.content import Facts, Heading, Paragraph, Part, Report
from scenarios.reports.cost import cost_parts
from scenarios.reports.diagnoses import MOODS, counted, diagnosis_parts
from scenarios.reports.gains import note_paragraphs, payload_tables, reason_paragraph
from scenarios.reports.identify import identified_table, kept_paragraphs, summary
from scenarios.reports.motion import coverage_plot, motion_table
from scenarios.reports.pages import provenance
from scenarios.reports.pages.gain_plots import error_plot, share_plot, value_plot, what_would_show
from scenarios.reports.pages.residual_plots import AGAINST, SPECTRUM, against, outliers, spectrum_plot
from scenarios.reports.pages.torque_plots import TOLD, torque_plot
from scenarios.reports.run import conclusion, judged_table
from scenarios.reports.unseen import unseen_parts, unseen_verdict
from scenarios.results.fit_rows import Fit, read_fit
from scenarios.results.models.run import Result
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import RecordFile, identify_words, read_saved


def page(folder: Path) -> Report:
    """Return the page of a folder.

    Raises:
        ScenarioError: If it holds no run or identification, or one of another version; if a file is missing or changed.
    """
    (record, result, given), fit = read_saved(folder, Result), read_fit(folder)
    names = provenance.named([motion.log for motion in fit.motions])
    parts: list[Part] = [_verdict(result), *unseen_verdict(result.unseen), _facts(result, record, given)]
    parts += _gains(result, fit, given.arm.revolute)
    if result.unseen is not None:
        parts += [Heading("A motion that was not used in any fit"), *unseen_parts(result.unseen)]
    if result.cost is not None:
        parts += [Heading("Effect of a-priori gains"), *cost_parts(result.cost, given.arm.revolute)]
    parts += _refusals(result, given.gains.max_rel_std)
    parts += kept_paragraphs(result)
    parts += diagnosis_parts(result.found)
    parts += [
        Heading("Torques, measured and reconstructed"),
        Paragraph(TOLD),
        *(torque_plot(each, names, fit.begins) for each in fit.rows),
        Heading("Residual: spectrum", folded=True),
        Paragraph(SPECTRUM),
        *(spectrum_plot(each, fit.row_period, lag) for each, lag in zip(fit.rows, fit.correlation, strict=True)),
    ]
    for what in ("position", "speed"):
        drawn = (against(each, what) for each in fit.rows)
        parts += [Heading(f"Residual against {what}", folded=True), Paragraph(AGAINST), *drawn]
    parts += [Heading("Outliers"), *outliers(fit.rows, names)]
    parts += _motion(fit, names, given.arm)
    again = identify_words(folder, record)
    parts += provenance.origin(record, provenance.payloads(record, given), given.arm, again, result.seed)
    return Report(record.title, tuple(parts), result.model_dump(mode="json"))


def _facts(result: Result, record: RecordFile, given: GivenProblem) -> Facts:
    """Return the key facts: number of gains, errors or intervals, fit, payload, date."""
    found = [gain for gain in result.gains if gain.estimate is not None and gain.std is not None]
    pairs = [("Gains identified", f"{len(found)} of {len(result.gains)}")]
    if found and result.judged:
        worst = max(found, key=lambda gain: abs(gain.rel_error or 0.0))
        pairs.append(
            ("Worst error", f"{two_digits(100.0 * (worst.rel_error or 0.0), sign='+')} %, joint {worst.joint}")
        )
    elif found:
        share, joint = max((2.0 * (gain.std or 0.0) / abs(gain.estimate or 1.0), gain.joint) for gain in found)
        pairs.append(("Widest interval", f"± {two_digits(100.0 * share)} %, joint {joint}"))
    masses = dict.fromkeys(provenance.mass(payload) for payload in provenance.payloads(record, given).values())
    pairs.append(("Relative residual", f"{100.0 * result.fit.rel_error_norm:.2f} %"))
    pairs.append(("Payload", " and ".join(masses) or "none"))
    return Facts((*pairs, ("Date", record.created[:10])))


def _verdict(result: Result) -> Paragraph:
    return conclusion(result.gains) if result.judged else with_warnings(summary(result), result.found)


def with_warnings(said: Paragraph, found: Diagnosed) -> Paragraph:
    """Return a verdict without true gains, with the number of faults and warnings."""
    if not found.findings:
        return said
    return replace(said, text=f"{said.text} See {counted(found)} below.", mood=MOODS[found.severity])


def _gains(result: Result, fit: Fit, revolute: Array) -> list[Part]:
    if result.judged:
        table, plot = judged_table(result.gains, revolute), error_plot(result.gains)
    else:
        shares = [fit.residual_share(joint) for joint in range(len(result.gains))]
        table = identified_table(result.gains, shares, revolute)
        believed = {} if result.cost is None else {each.joint: each.a_priori_gain for each in result.cost.joints}
        plot = value_plot(result.gains, {joint: gain for joint, gain in believed.items() if gain})
    told = (
        f"{result.fit.rows} rows by {result.fit.method}, relative residual {100.0 * result.fit.rel_error_norm:.2f} %."
    )
    notes = note_paragraphs(result.notes, result.found, revolute)
    found = any(gain.identifiable for gain in result.gains)
    plots: list[Part] = [plot, share_plot(result.gains)] if found else []
    return [Heading("Gains"), table, Paragraph(told), *notes, *plots, *payload_tables(result.payload)]


def _refusals(result: Result, allowed: float) -> list[Part]:
    """Return the reasons of refused and failed joints, and what would identify their gains."""
    reasons: list[Part] = [
        reason_paragraph(each.joint, each.reason) for each in result.gains if each.reason is not None
    ]
    shown = what_would_show(result.gains, allowed)
    return [Heading("Refused or failed joints, and how to identify them"), *reasons, *shown] if reasons else []


def _motion(fit: Fit, names: tuple[str, ...], arm: Arm) -> list[Part]:
    recorded = {name: each.joints for name, each in zip(names, fit.motions, strict=True)}
    tables = [motion_table(name, motions, arm) for name, motions in recorded.items()]
    return [Heading("Motion and joint ranges covered"), coverage_plot(recorded, arm), *tables]
