"""What `rx90 paper` says: tables 2 to 4 and figure 3 beside the published ones, and whether the claims hold."""

from typing import TYPE_CHECKING

import scenarios.paper.published as published
from ident.estimate import IdentifiedGain
from ident.parameters import INERTIAL, UNITS
from ident.payload_parameters import PayloadEstimate
from scenarios.paper.experiment import IDENTIFIED, Check, PaperRun
from scenarios.reports.content import Cell, Column, Figure, Mood, Paragraph, Part, Report, Table, cells
from scenarios.store.paper_folder import paper_document

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

FIGURE_3 = "figure3"


def paper_report(run: PaperRun) -> Report:
    """Tables, figure, claims and the verdict."""
    parts: list[Part] = [_table_2(run), _table_3(run), _table_4(run), _second_payload(run), _all_parameters(run)]
    parts.append(
        Figure(
            FIGURE_3,
            "Figure 3: torques of case 2, measured and reconstructed",
            lambda: _figure_3(run),
            endings=("png", "svg"),
        )
    )
    parts += [_claim(check) for check in run.checks]
    failed = sum(not check.holds for check in run.checks)
    verdict = Paragraph(f"PASSED: all {len(run.checks)} claims hold.", Mood.GOOD, strong=True)
    if failed:
        verdict = Paragraph(f"MISSED: {failed} claims fail.", Mood.BAD, strong=True)
    title = f"Gautier and Briot (2011), section IV, on the simulated RX-90, seed {run.seed}"
    return Report(title, (*parts, verdict), paper_document(run))


def _figure_3(run: PaperRun) -> "Drawing":
    from scenarios.reports.plots.paper import figure_3  # Matplotlib, half a second

    return figure_3(run)


def _claim(check: Check) -> Paragraph:
    return Paragraph(f"holds: {check.claim}") if check.holds else Paragraph(f"FAILS: {check.claim}", Mood.BAD)


def _numbers(first: str, *titles: str) -> tuple[Column, ...]:
    """Headings: words, then numbers; a unit follows a bar."""
    pairs = (title.partition("|") for title in titles)
    return (Column(title=first, words=True), *(Column(title=title, unit=unit) for title, _, unit in pairs))


def _table_2(run: PaperRun) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1):
        for name, value, two_sigma in (("MZ", printed.MZ, printed.MZ_2sigma), ("M", printed.M, printed.M_2sigma)):
            found, true = case[name], run.payloads[0][INERTIAL.index(name)]
            ours = (f"{found.value:.3f}", f"{2 * found.std:.4f}", f"{100 * found.rel_std:.1f}")
            theirs = (f"{value:.3f}", f"{two_sigma:.4f}", f"{50 * two_sigma / value:.1f}")
            rows.append(cells(f"case {k} {name}", f"{true:.3f}", *ours, *theirs))
    columns = _numbers(
        "Parameter", "true", "ours", "2 sigma", "rel. sigma|%", "paper", "paper's\n2 sigma", "paper's\nrel. sigma|%"
    )
    title = "Table 2: payload parameters with the gains of each case [kg m, kg]"
    return Table(title=title, columns=columns, rows=tuple(rows))


def _table_3(run: PaperRun) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for j, (joint, true) in enumerate(zip(run.gains.joints, run.true_gain, strict=True)):
        ours = ("refused", "-")
        if isinstance(joint, IdentifiedGain):
            ours = (f"{joint.value:.4f}", f"{2 * joint.std:.4f}")
        theirs = ("-", "-")
        if j < IDENTIFIED:
            theirs = (f"{published.GAINS[j]:.4f}", f"{published.GAINS_2SIGMA[j]:.4f}")
        rows.append(cells(f"joint {j + 1}", f"{true:.4f}", *ours, *theirs))
    columns = _numbers("Joint", "injected", "ours", "2 sigma", "paper", "paper's\n2 sigma")
    return Table(title="Table 3: identified drive gains [N m / drive unit]", columns=columns, rows=tuple(rows))


def _table_4(run: PaperRun) -> Table:
    rows = tuple(
        cells(
            f"case {k}",
            f"{case.error_norm:.2f}",
            f"{case.rel_error_norm:.4f}",
            f"{case.sigma:.4f}",
            f"{len(case.system.V) - case.unknowns}",
            f"{printed.error_norm:.2f}",
            f"{printed.rel_error_norm:.4f}",
            f"{printed.sigma:.4f}",
            f"{published.ROWS_LESS_UNKNOWNS}",
        )
        for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1)
    )
    ours = ("norm", "relative", "sigma", "r - b")
    columns = _numbers("Case", *ours, *(f"paper's\n{title}" for title in ours))
    return Table(
        title="Table 4: error norm, relative norm, sigma, rows less unknowns; ours, then the paper's",
        columns=columns,
        rows=rows,
    )


def _second_payload(run: PaperRun) -> Table:
    found, true = run.second["M"], run.payloads[1][-1]
    row = cells(
        "M",
        f"{true:.3f}",
        f"{found.value:.3f}",
        f"{2 * found.total_std:.3f}",
        f"{published.SECOND_MASS:.3f}",
        f"{published.SECOND_MASS_2SIGMA:.3f}",
    )
    columns = _numbers("Parameter", "true", "ours", "2 sigma", "paper", "paper's\n2 sigma")
    return Table(title="The second payload with the gains of case 2 [kg]", columns=columns, rows=(row,))


def _all_parameters(run: PaperRun) -> Table:
    names = [f"{name} [{UNITS[name]}]" for name in INERTIAL]
    again = run.second.parameters
    rows = tuple(
        cells(
            label,
            f"{run.payloads[0][k]:.4f}",
            *(f"{e.parameters[k].value:.4f} ± {2 * e.parameters[k].std:.4f}{_mark(e, k)}" for e in run.cases),
            f"{run.payloads[1][k]:.4f}",
            f"{again[k].value:.4f} ± {2 * again[k].total_std:.4f}{_mark(run.second, k)}",
        )
        for k, label in enumerate(names)
    )
    columns = _numbers("Parameter", "true", "case 1", "case 2", "case 3", "second, true", "second")
    title = "All ten parameters, ± 2 sigma; * essential: relative standard deviation under 10 %"
    return Table(title=title, columns=columns, rows=rows, file_only=True)


def _mark(estimate: PayloadEstimate, k: int) -> str:
    return " *" if estimate.parameters[k].essential else ""
