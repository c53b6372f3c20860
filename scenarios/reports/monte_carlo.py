"""Report of a Monte Carlo study: verdict, errors and intervals by joint, failures by kind, figures."""

from collections.abc import Sequence

from scenarios.experiments.statistics import JointStatistics, StudyResult, StudyRows
from scenarios.rendering.content import (
    Cell,
    Figure,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    column,
    joints_named,
    percent,
    table,
)
from scenarios.reports.error_density import panels, varies
from scenarios.reports.plots import monte_carlo as plots

MOODS = {True: Mood.PLAIN, False: Mood.BAD}
"""Verdicts for a pass rate that holds and one that does not."""
HISTOGRAM, QQ, AGAINST_TRUE = "errors", "z-scores", "error-against-gain"
MEANING = (
    "Bias, std: mean and standard deviation of the error. Estimated std: rms of the standard deviations that "
    "the trials estimate, all contributions included. Within: trials with an error below 1 or 2 of these; "
    "correct ones give 68.3 % and 95.4 %. A joint that is refused passes if the scenario expects it."
)


def monte_carlo_report(result: StudyResult, rows: StudyRows, *, asked: int) -> Report:
    """Return the report: verdict, one row per joint, meaning of the columns, failures by kind, figures."""
    more = f" (the folder contains more than the {asked} requested)" if result.trials > asked else ""
    parts: list[Part] = [_verdict(result.joints), _table(result.joints), Paragraph(MEANING)]
    parts += [
        Paragraph(f"{count} {'trial' if count == 1 else 'trials'} failed: {kind}.")
        for kind, count in result.failures.items()
    ]
    parts += _figures(result, rows)
    title = f"Scenario {result.scenario}, {result.trials} trials from seed {result.seed}{more}"
    return Report(title, tuple(parts), result.model_dump(mode="json"))


def _table(joints: Sequence[JointStatistics]) -> Table:
    return table(
        joints,
        column("Joint", lambda joint: joint.joint),
        column("Bias [%]", lambda joint: percent(joint.bias, "+.3f")),
        column("Std [%]", lambda joint: percent(joint.spread)),
        column("Estimated\nstd [%]", lambda joint: percent(joint.claimed)),
        column("95 %\nbelow [%]", lambda joint: percent(joint.p95)),
        column("Within\n1 sigma [%]", lambda joint: percent(joint.cover_1, ".1f")),
        column("Within\n2 sigma [%]", lambda joint: percent(joint.cover_2, ".1f")),
        column("Gains", lambda joint: joint.trials - joint.failed - joint.refused),
        column("Passed [%]", lambda joint: Cell(percent(joint.pass_rate, ".1f"), MOODS[joint.held])),
        column(
            "95 % interval [%]", lambda joint: f"{percent(joint.pass_low, '.1f')}..{percent(joint.pass_high, '.1f')}"
        ),
    )


def _verdict(statistics: Sequence[JointStatistics]) -> Paragraph:
    """Return the verdict on the pass rate."""
    failed = [joint.joint for joint in statistics if not joint.held]
    trials, allowed, wanted = statistics[0].trials, statistics[0].allowed, f"{100.0 * statistics[0].wanted:g} %"
    worst = min(statistics, key=lambda joint: joint.pass_rate)
    missed = round((1.0 - worst.pass_rate) * trials)
    rule = (
        f"{trials} {'trial is' if trials == 1 else 'trials are'} too few to test a pass rate of {wanted}"
        if allowed >= trials
        else f"a pass rate of {wanted} allows {allowed}"
    )
    if failed:
        fail = f"{joints_named(failed)} {'fail' if failed[1:] else 'fails'} the tolerance"
        return Paragraph(
            f"FAILED: {fail} (worst: joint {worst.joint}, in {missed} of {trials} trials; {rule}).",
            Mood.BAD,
            strong=True,
        )
    said = (
        f"no joint fails in more than {missed} of {trials} trials"
        if missed
        else f"every joint passes in all {trials} trials"
    )
    return Paragraph(f"PASSED: {said} ({rule}).", Mood.GOOD, strong=True)


def _figures(result: StudyResult, rows: StudyRows) -> list[Figure]:
    """Return the possible figures: errors need two trials with a gain, and gains on an axis must differ."""
    shown = panels(rows.joints)
    subject = plots.Subject(
        title=f"{result.scenario}, {result.trials} trials",
        without=tuple(joint.joint for joint in result.joints if joint.joint not in shown),
    )
    if not shown:
        return []
    figures = [
        Figure(
            HISTOGRAM,
            "Errors and the density estimated for them",
            lambda: plots.histograms(shown, subject),
        ),
        Figure(QQ, "z-scores against normal quantiles", lambda: plots.quantiles(shown, subject)),
    ]
    drawn = {joint: own for joint, own in shown.items() if varies(own.true)}
    if drawn:
        figures.append(
            Figure(AGAINST_TRUE, "Error against the injected gain", lambda: plots.against_true(drawn, subject))
        )
    return figures
