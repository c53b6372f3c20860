"""Report of comparisons of methods: scores, coverage of intervals, failures, properties."""

from collections.abc import Callable, Sequence

from ident.support.naming import enumerated
from scenarios.benchmark.comparison.contract import Contract
from scenarios.benchmark.comparison.statistics import (
    FAR,
    RANKED_BY,
    SOLVED,
    SURE,
    ComparedScenario,
    Comparison,
    MethodSummary,
)
from scenarios.experiments.statistics import Coverage
from scenarios.rendering.content import (
    NONE,
    Cell,
    Heading,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    column,
    number,
    percent,
    sentence,
    table,
)

RULE = (
    f"Score: the number of gains within {100.0 * RANKED_BY:g} % minus the number of wrong gains, over the number of "
    "gains that the data should determine, so refusing everything scores 0. A gain is wrong if its error exceeds both "
    f"{100.0 * FAR:g} % and {SURE:g} of its estimated standard deviations. If the scenario says that the data do not "
    "determine the gain, it is wrong unless its error is below both limits and its estimated standard deviation is "
    f"below {100.0 * FAR:g} %. A gain lost to a crash, a time-out or an invalid answer is neither solved nor refused. "
    "Time: median of a call, including process start and reading of files."
)
MEANING = (
    "Bias, std: mean and standard deviation of the error. Within: share of trials with an error below 1 or 2 "
    "estimated standard deviations (68.3 % and 95.4 % if these are correct), with the 95 % interval of the latter "
    "(Clopper and Pearson). Bound: Cramer-Rao, of all joints together for the injected current noise at "
    "its level in the band of the rows, without encoder noise and errors of payload or model. If a scenario draws "
    "values, the bound is computed with the values in its file."
)


def comparison_report(found: Comparison) -> Report:
    """Return the report: best method, tables of methods and joints for each scenario, scoring rule, provenance."""
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
    """Return the best methods of each scenario and the next one, in a sentence."""
    text = "; ".join(f"on {each.name} {_best(each.methods)}" for each in compared)
    return Paragraph(f"{text[0].upper()}{text[1:]}.", strong=True)


def _best(methods: Sequence[MethodSummary]) -> str:
    """Return the methods with the highest score, as it is shown, and the next one; `methods` are in order of score."""
    scores = [f"{100.0 * each.score:.1f} %" for each in methods]
    first = [each.method for each, score in zip(methods, scores, strict=True) if score == scores[0]]
    best, rest = f"{enumerated(first)} {'score' if first[1:] else 'scores'} {scores[0]}", len(first)
    return f"{best}, {methods[rest].method} {scores[rest]}" if rest < len(methods) else best


def _ranks(compared: ComparedScenario) -> Table:
    def within(k: int) -> Callable[[MethodSummary], str]:
        return lambda each: percent(each.solved[k], ".1f")

    return table(
        compared.methods,
        column("Method", lambda each: each.method, words=True),
        column("Score [%]", lambda each: percent(each.score, ".1f")),
        *(column(f"Within\n{100.0 * share:g} % [%]", within(k)) for k, share in enumerate(SOLVED)),
        column("Refused\nrightly", lambda each: each.refused_rightly),
        column("Refused\nwrongly", lambda each: each.refused_wrongly),
        column("Wrong\ngains", lambda each: _bad(each.wrong_claims)),
        column("Wrong\nsigns", lambda each: _bad(each.wrong_signs)),
        column("Crashes", lambda each: _bad(each.crashes), file_only=True),
        column("Time\nouts", lambda each: _bad(each.time_outs), file_only=True),
        column("Invalid\nanswers", lambda each: _bad(each.misfits), file_only=True),
        column("Time [s]", lambda each: number(each.seconds, ".2g")),
    )


def _joints(compared: ComparedScenario) -> Table:
    return table(
        [(each.method, joint) for each in compared.methods for joint in each.joints],
        column("Method", lambda row: row[0], words=True),
        column("Joint", lambda row: row[1].joint),
        column("Gains", lambda row: row[1].gains),
        column("Bias [%]", lambda row: percent(row[1].bias, "+.3f")),
        column("Std [%]", lambda row: percent(row[1].spread)),
        column("Rms [%]", lambda row: percent(row[1].rms)),
        column("95 %\nbelow [%]", lambda row: percent(row[1].p95)),
        column("Within\n1 sigma [%]", lambda row: _held(row[1].cover_1)[0], file_only=True),
        column("Within\n2 sigma [%]", lambda row: _held(row[1].cover_2)[0]),
        column("95 % interval [%]", lambda row: _held(row[1].cover_2)[1], file_only=True),
        column("Estimated\nstd [%]", lambda row: percent(row[1].claimed)),
        column("Bound [%]", lambda row: percent(row[1].bound)),
        column("Std\nover bound", lambda row: number(row[1].spread_over_bound, ".2f"), file_only=True),
        column("Estimated std\nover bound", lambda row: number(row[1].claimed_over_bound, ".2f"), file_only=True),
    )


def _held(coverage: Coverage | None) -> tuple[str, str]:
    if coverage is None:
        return NONE, NONE
    return percent(coverage.share, ".1f"), f"{percent(coverage.low, '.1f')}..{percent(coverage.high, '.1f')}"


def _bad(count: int) -> Cell:
    return Cell(str(count), Mood.BAD if count else Mood.PLAIN)


def _failures(compared: ComparedScenario) -> list[Paragraph]:
    return [
        Paragraph(f"{each.method}: {', '.join(f'{count} {kind}' for kind, count in each.failures.items())}.")
        for each in compared.methods
        if each.failures
    ]


def contract_report(found: Contract) -> Report:
    """Return the report of a contract: verdict, one row per property, a sentence for each violation."""
    rows = table(
        found.checks,
        column("Property", lambda check: check.promise, words=True),
        column(
            "Verdict", lambda check: Cell("holds", Mood.GOOD) if check.kept else Cell("FAILS", Mood.BAD), words=True
        ),
    )
    broken = [check for check in found.checks if not check.kept]
    said = [Paragraph(sentence(f"Not fulfilled: {check.promise}: {check.broken}")) for check in broken]
    verdict = (
        Paragraph(f"FAILED: {len(broken)} of {len(found.checks)} properties do not hold.", Mood.BAD, strong=True)
        if broken
        else Paragraph(f"PASSED: all {len(found.checks)} properties hold.", Mood.GOOD, strong=True)
    )
    return Report(f"Method {found.method}", (verdict, rows, *said), found.model_dump(mode="json"))
