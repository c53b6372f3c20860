"""What a comparison says: who solved how much of each scenario, how often intervals held, and what went wrong."""

from collections.abc import Sequence

from scenarios.benchmark.comparison.statistics import FAR, RANKED_BY, SOLVED, SURE, ComparedScenario, Comparison
from scenarios.experiments.studies.coverage import Coverage
from scenarios.reports.content import NONE, Cell, Column, Heading, Mood, Paragraph, Part, Report, Table, cells, percent

RANKS = (
    Column(title="Method", words=True),
    Column(title="Score", unit="%"),
    *(Column(title=f"Within\n{100.0 * share:g} %", unit="%") for share in SOLVED),
    Column(title="Refused\nrightly"),
    Column(title="Refused\nwrongly"),
    Column(title="Wrong\nclaims"),
    Column(title="Wrong\nsigns"),
    Column(title="Crashes", file_only=True),
    Column(title="Time\nouts", file_only=True),
    Column(title="Misfits", file_only=True),
    Column(title="Time", unit="s"),
)
JOINTS = (
    Column(title="Method", words=True),
    Column(title="Joint"),
    Column(title="Gains"),
    Column(title="Bias", unit="%"),
    Column(title="Spread", unit="%"),
    Column(title="Rms", unit="%"),
    Column(title="95 %\nbelow", unit="%"),
    Column(title="Within\n1 sigma", unit="%", file_only=True),
    Column(title="Within\n2 sigma", unit="%"),
    Column(title="95 % interval", unit="%", file_only=True),
    Column(title="Claimed", unit="%"),
    Column(title="Bound", unit="%"),
    Column(title="Spread\nover bound", file_only=True),
    Column(title="Claimed\nover bound", file_only=True),
)
RULE = (
    f"Order: gains within {100.0 * RANKED_BY:g} % less wrong claims, as a share of the gains that the "
    "data should give, so refusing everything scores 0. A claim is wrong if it is off by more than "
    f"{100.0 * FAR:g} % and by more than {SURE:g} of its stated deviations; of a gain that the scenario "
    f"says the data cannot give, also if it states no deviation below {100.0 * FAR:g} %, or is off by "
    f"more than {SURE:g} of them. A gain lost to a crash, a time-out or an invalid answer counts neither "
    "as solved nor as refused. Time: median of a call, start of a process and reading of files included."
)
MEANING = (
    "Bias, spread: mean and standard deviation of the error. Within: trials that err by less than 1 or 2 "
    "stated deviations, correct ones give 68.3 % and 95.4 %; with the 95 % interval of the latter "
    "(Clopper and Pearson). Bound: Cramer-Rao, of all joints together for the injected current noise at "
    "its level in the band of the rows, without encoder noise and errors of payload or model. Of a "
    "scenario that draws numbers, it is that of the numbers it states."
)


def comparison_report(found: Comparison) -> Report:
    """Who solves most, tables of methods and of joints for each scenario, the rule of the order, how to repeat it."""
    compared = found.scenarios
    parts: list[Part] = [_verdict(compared)]
    for each in compared:
        trials = "1 trial" if each.trials == 1 else f"{each.trials} trials"
        parts += [Heading(f"{each.name}, {trials}"), _ranks(each), *_failures(each), _joints(each)]
        if each.unposed:
            parts.append(Paragraph(f"{each.unposed} of them failed before any method was run."))
    parts += [Paragraph(RULE), Paragraph(MEANING)]
    parts += [Paragraph(f"{key}: {text}.") for key, text in found.about.items()]
    many = len(compared[0].methods)
    title = f"{many} {'method' if many == 1 else 'methods'} compared on {', '.join(each.name for each in compared)}"
    return Report(title, tuple(parts), found.model_dump(mode="json"))


def _verdict(compared: Sequence[ComparedScenario]) -> Paragraph:
    """Who solves most of each scenario, in a sentence."""
    said = [
        f"on {each.name} {each.methods[0].method} scores {100.0 * each.methods[0].score:.1f} %"
        + (f", {each.methods[1].method} {100.0 * each.methods[1].score:.1f} %" if len(each.methods) > 1 else "")
        for each in compared
    ]
    text = "; ".join(said)
    return Paragraph(f"{text[0].upper()}{text[1:]}.", strong=True)


def _ranks(compared: ComparedScenario) -> Table:
    rows = tuple(
        cells(
            each.method,
            percent(each.score, ".1f"),
            *(percent(share, ".1f") for share in each.solved),
            str(each.refused_rightly),
            str(each.refused_wrongly),
            *(_bad(count) for count in (each.wrong_claims, each.wrong_signs)),
            *(_bad(count) for count in (each.crashes, each.time_outs, each.misfits)),
            NONE if each.seconds is None else f"{each.seconds:.2g}",
        )
        for each in compared.methods
    )
    return Table(columns=RANKS, rows=rows)


def _joints(compared: ComparedScenario) -> Table:
    rows = tuple(
        cells(
            each.method,
            str(joint.joint),
            str(joint.gains),
            percent(joint.bias, "+.3f"),
            percent(joint.spread),
            percent(joint.rms),
            percent(joint.p95),
            *_held(joint.cover_1)[:1],
            *_held(joint.cover_2),
            percent(joint.claimed),
            percent(joint.bound),
            _ratio(joint.spread_over_bound),
            _ratio(joint.claimed_over_bound),
        )
        for each in compared.methods
        for joint in each.joints
    )
    return Table(columns=JOINTS, rows=rows)


def _held(coverage: Coverage | None) -> tuple[str, str]:
    if coverage is None:
        return NONE, NONE
    return percent(coverage.share, ".1f"), f"{percent(coverage.low, '.1f')}..{percent(coverage.high, '.1f')}"


def _ratio(value: float | None) -> str:
    return NONE if value is None else f"{value:.2f}"


def _bad(count: int) -> Cell:
    return Cell(str(count), Mood.BAD if count else Mood.PLAIN)


def _failures(compared: ComparedScenario) -> list[Paragraph]:
    return [
        Paragraph(f"{each.method}: {', '.join(f'{count} {kind}' for kind, count in each.failures.items())}.")
        for each in compared.methods
        if each.failures
    ]
