"""The page of a run or an identification: verdict, gains, refusals, torques, residuals, motion, consistency, origin."""

from dataclasses import replace
from pathlib import Path

from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.samples.motion import joint_motions
from scenarios.reports.content import Heading, Mood, Paragraph, Part, Report
from scenarios.reports.diagnoses import MOODS
from scenarios.reports.gains import gain_unit, note_paragraphs, payload_tables, reason_paragraph
from scenarios.reports.identify import identified_table, summary
from scenarios.reports.motion import coverage_plot, motion_table
from scenarios.reports.pages import provenance
from scenarios.reports.pages.diagnoses import diagnosis_parts
from scenarios.reports.pages.fit_rows import begins, fit_rows
from scenarios.reports.pages.gain_plots import error_plot, share_plot, value_plot, what_would_show
from scenarios.reports.pages.reanalysis import Again, identified_again
from scenarios.reports.pages.residual_plots import AGAINST, SPECTRUM, against, outliers, spectrum_plot
from scenarios.reports.pages.torque_plots import TOLD, torque_plot
from scenarios.reports.run import conclusion, judged_table
from scenarios.results.record import RESULT, identify_words


def page(folder: Path) -> Report:
    """Everything that the folder tells.

    Raises:
        ForeignResult: If it holds no run or identification, or one of another version.
        DamagedResult: If a file is missing or changed.
    """
    again = identified_again(folder)
    problem, estimate = again.problem, again.estimate
    logs = [motion.recording for motion in again.motions]
    rows = [fit_rows(problem, estimate, joint, logs) for joint in sorted(estimate.solution.rows.unknowns)]
    names = provenance.named([log.name for log in logs])
    parts: list[Part] = [_verdict(again), *_differences(again), *_gains(again)]
    parts += _refusals(again)
    parts += diagnosis_parts(again.result.found)
    parts += [
        Heading("Torques, measured and reconstructed"),
        Paragraph(TOLD),
        *(torque_plot(each, names, begins(logs)) for each in rows),
        Heading("Residual: spectrum"),
        Paragraph(SPECTRUM),
        *(spectrum_plot(each, estimate.solution.rows) for each in rows),
    ]
    for what in ("position", "speed"):
        parts += [Heading(f"Residual against {what}"), Paragraph(AGAINST), *(against(each, what) for each in rows)]
    parts += [Heading("Outliers"), *outliers(rows, names)]
    parts += _motion(again, names)
    given = provenance.payloads(again.record, again.given)
    parts += provenance.assumed(again.record, given, again.problem.structure.arm)
    parts += _repeated(again)
    return Report(again.record.title, tuple(parts), again.document)


def _verdict(again: Again) -> Paragraph:
    if again.result.judged:
        return conclusion([gain.verdict for gain in again.result.gains])
    fit = again.result.fit
    return with_warnings(
        summary(again.result.joints, fit.rows, fit.rel_error_norm, again.result.found), again.result.found
    )


def with_warnings(said: Paragraph, found: Diagnosed) -> Paragraph:
    """A verdict without a truth, and how many warnings there are."""
    failed = len(found.findings)
    if not failed:
        return said
    below = "A warning stands below." if failed == 1 else f"{failed} warnings stand below."
    return replace(said, text=f"{said.text} {below}", mood=MOODS[found.severity])


def _differences(again: Again) -> list[Part]:
    """That identification gives something else now, if it does."""
    if not again.differences:
        return []
    said = f"Re-identified from these files, the gains differ from those of {RESULT}: {'; '.join(again.differences)}."
    why = "The table shows what was saved; all plots but those of the gains show what is identified now."
    return [Paragraph(f"{said} {why}", Mood.BAD, strong=True)]


def _gains(again: Again) -> list[Part]:
    result, revolute = again.result, again.problem.structure.arm.revolute
    estimate = again.estimate
    if result.judged:
        verdicts = [gain.verdict for gain in result.gains]
        table, plot = judged_table(verdicts, result.joints, revolute), error_plot(verdicts)
    else:
        shares = [estimate.residual_share(joint) for joint in range(len(result.joints))]
        table = identified_table(result.joints, shares, revolute)
        plot = value_plot(result.joints, gain_unit(revolute))
    fit = result.fit
    told = f"{fit.rows} rows by {fit.method}, relative residual {100.0 * fit.rel_error_norm:.2f} %."
    notes = note_paragraphs(result.notes, result.found, revolute)
    found = any(gain.identifiable for gain in result.gains)
    plots: list[Part] = [plot, share_plot(result.joints)] if found else []
    return [Heading("Gains"), table, Paragraph(told), *notes, *plots, *payload_tables(result.parameters)]


def _refusals(again: Again) -> list[Part]:
    """Why joints are refused or have missed, and what would show them."""
    reasons: list[Part] = [
        reason_paragraph(gain.joint, gain.reason) for gain in again.result.gains if gain.reason is not None
    ]
    shown = what_would_show(again.result.joints, again.problem.options.max_rel_std)
    return [Heading("Refused or missed, and what would show it"), *reasons, *shown] if reasons else []


def _motion(again: Again, names: tuple[str, ...]) -> list[Part]:
    arm, observing = again.problem.structure.arm, again.given.observing
    recorded = {
        name: joint_motions(each.recording, arm, observing) for name, each in zip(names, again.motions, strict=True)
    }
    tables = [motion_table(name, motions, arm) for name, motions in recorded.items()]
    return [Heading("Motion, and what it covers"), coverage_plot(recorded, arm), *tables]


def _repeated(again: Again) -> list[Part]:
    record, result = again.record, again.result
    commands = {"The same from these files": identify_words(again.folder, record)}
    if record.command:
        commands = {"As it was made": record.command, **commands}
    about = {
        "Made": record.created,
        **({} if result.seed is None else {"Seed": str(result.seed)}),
        "Recordings": ", ".join(record.sources),
        "Versions": provenance.versions_in_words(record.versions),
    }
    return provenance.repeated(commands, about, record.files)
