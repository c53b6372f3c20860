"""Report of `rx90 paper`: tables 2 to 4 and figure 3 with the published values, and the claims."""

from typing import TYPE_CHECKING

import scenarios.benchmark.paper.published as published
from ident.model.parameters import INERTIAL, UNITS
from scenarios.benchmark.paper.experiment import IDENTIFIED
from scenarios.benchmark.paper.result import Claim, PaperPayload, PaperResult
from scenarios.rendering.content import (
    NONE,
    Cell,
    Column,
    Figure,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    cells,
    sentence,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Drawing

FIGURE_3 = "figure3"


def paper_report(found: PaperResult, torques: "pd.DataFrame", seed: int) -> Report:
    """Return the report: verdict, tables, figure and claims. Figure 3 shows `torques`, the rows of case 2."""
    parts: list[Part] = [_table_2(found), _table_3(found)]
    parts += [
        Paragraph(sentence(f"Joint {each.joint}: {each.reason}")) for each in found.gains if each.reason is not None
    ]
    parts += [_table_4(found), _patterns(found), _second_payload(found), _all_parameters(found)]

    def draw() -> "Drawing":
        from scenarios.reports.plots.paper import figure_3

        return figure_3(torques)

    parts.append(Figure(FIGURE_3, "Figure 3: torques of case 2, measured and reconstructed", draw, ("png", "svg")))
    parts += [_claim(check) for check in found.checks]
    failed = sum(not check.holds for check in found.checks)
    verdict = Paragraph(f"PASSED: all {len(found.checks)} claims hold.", Mood.GOOD, strong=True)
    if failed:
        verdict = Paragraph(f"FAILED: {failed} of {len(found.checks)} claims do not hold.", Mood.BAD, strong=True)
    title = f"Gautier and Briot (2011), section IV, on the simulated RX-90, seed {seed}"
    return Report(title, (verdict, *parts), found.model_dump(mode="json"))


def _claim(check: Claim) -> Paragraph:
    return Paragraph(f"holds: {check.claim}") if check.holds else Paragraph(f"FAILS: {check.claim}", Mood.BAD)


def _numbers(first: str, *titles: str) -> tuple[Column, ...]:
    """Return columns: of words, then of numbers; a unit follows a bar."""
    pairs = (title.partition("|") for title in titles)
    return (Column(title=first, words=True), *(Column(title=title, unit=unit) for title, _, unit in pairs))


def _table_2(found: PaperResult) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for k, (case, printed) in enumerate(zip(found.cases, published.CASES, strict=True), 1):
        for name, value, two_sigma in (("MZ", printed.MZ, printed.MZ_2sigma), ("M", printed.M, printed.M_2sigma)):
            own = case[name]
            rel_std = f"{100 * own.std / abs(own.estimate):.1f}" if own.estimate else NONE
            ours = (f"{own.estimate:.3f}", f"{2 * own.std:.4f}", rel_std)
            theirs = (f"{value:.3f}", f"{two_sigma:.4f}", f"{50 * two_sigma / value:.1f}")
            rows.append(cells(f"case {k} {name}", f"{own.true:.3f}", *ours, *theirs))
    columns = _numbers(
        "Parameter", "True", "Ours", "2 sigma", "Rel. sigma|%", "Paper", "Paper's\n2 sigma", "Paper's\nrel. sigma|%"
    )
    title = "Table 2: payload parameters with the gains of each case [kg m, kg]"
    return Table(title=title, columns=columns, rows=tuple(rows))


def _table_3(found: PaperResult) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for j, gain in enumerate(found.gains):
        ours = ("refused", NONE)
        if gain.estimate is not None and gain.std is not None:
            ours = (f"{gain.estimate:.4f}", f"{2 * gain.std:.4f}")
        theirs = (NONE, NONE)
        if j < IDENTIFIED:
            theirs = (f"{published.GAINS[j]:.4f}", f"{published.GAINS_2SIGMA[j]:.4f}")
        rows.append(cells(f"joint {gain.joint}", f"{gain.true:.4f}", *ours, *theirs))
    columns = _numbers("Joint", "Injected", "Ours", "2 sigma", "Paper", "Paper's\n2 sigma")
    return Table(title="Table 3: identified drive gains [N m / drive unit]", columns=columns, rows=tuple(rows))


def _table_4(found: PaperResult) -> Table:
    rows = tuple(
        cells(
            f"case {k}",
            f"{case.fit.error_norm:.2f}",
            f"{case.fit.rel_error_norm:.4f}",
            f"{case.fit.sigma:.4f}",
            f"{case.fit.rows - case.fit.unknowns}",
            f"{printed.error_norm:.2f}",
            f"{printed.rel_error_norm:.4f}",
            f"{printed.sigma:.4f}",
            f"{published.ROWS_LESS_UNKNOWNS}",
        )
        for k, (case, printed) in enumerate(zip(found.cases, published.CASES, strict=True), 1)
    )
    ours = ("norm", "relative", "sigma", "r - b")
    columns = _numbers("Case", "Norm", "Relative", "Sigma", "r - b", *(f"Paper's\n{title}" for title in ours))
    return Table(
        title="Table 4: error norm, relative norm, sigma, degrees of freedom; ours, then the paper's",
        columns=columns,
        rows=rows,
    )


def _patterns(found: PaperResult) -> Table:
    rows = [
        cells(each.signs, f"{each.M:.3f}", f"{each.MZ:.3f}", f"{each.error_norm:.3f}")
        for each in sorted(found.patterns, key=lambda each: each.error_norm)
    ]
    two, three = published.CASES[1:]
    norm = three.rel_error_norm / two.rel_error_norm
    rows.append(cells("paper", f"{three.M / two.M:.3f}", f"{three.MZ / two.MZ:.3f}", f"{norm:.3f}"))
    return Table(
        title="Errors of 20 % on the gains of joints 1 to 4, by their signs: ratios to case 2",
        columns=_numbers("Signs", "M", "MZ", "Error norm"),
        rows=tuple(rows),
    )


def _second_payload(found: PaperResult) -> Table:
    mass = found.second_payload["M"]
    row = cells(
        "M",
        f"{mass.true:.3f}",
        f"{mass.estimate:.3f}",
        f"{2 * mass.std:.3f}",
        f"{published.SECOND_MASS:.3f}",
        f"{published.SECOND_MASS_2SIGMA:.3f}",
    )
    columns = _numbers("Parameter", "True", "Ours", "2 sigma", "Paper", "Paper's\n2 sigma")
    return Table(title="The second payload with the gains of case 2 [kg]", columns=columns, rows=(row,))


def _all_parameters(found: PaperResult) -> Table:
    first, second = found.cases[0].payload, found.second_payload
    rows = tuple(
        cells(
            f"{name} [{UNITS[name]}]",
            f"{first[k].true:.4f}",
            *(_about(case, k) for case in found.cases),
            f"{second.payload[k].true:.4f}",
            _about(second, k),
        )
        for k, name in enumerate(INERTIAL)
    )
    columns = _numbers("Parameter", "True", "Case 1", "Case 2", "Case 3", "Second, true", "Second")
    title = "All ten parameters, ± 2 sigma; * essential: relative standard deviation under 10 %"
    return Table(title=title, columns=columns, rows=rows, file_only=True)


def _about(case: PaperPayload, k: int) -> str:
    own = case.payload[k]
    return f"{own.estimate:z.4f} ± {2 * own.std:.4f}{' *' if own.essential else ''}"
