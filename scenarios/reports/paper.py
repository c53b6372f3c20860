"""The repeated experiment beside the published one: tables, figure 3, raw numbers, JSON."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import Console
from rich.table import Table
from rich.text import Text

import scenarios.paper.published as published
from ident.arrays import Array
from ident.estimate import IdentifiedGain
from ident.parameters import INERTIAL, UNITS
from ident.payload_parameters import PayloadEstimate
from scenarios.paper.experiment import IDENTIFIED, PaperRun


@dataclass(frozen=True, slots=True)
class PaperTable:
    """A table of text, for the terminal and for Markdown.

    Attributes:
        title: One line.
        columns: Headings.
        rows: Cells, one tuple a row.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(run: PaperRun) -> tuple[PaperTable, ...]:
    """Tables 2, 3 and 4 and the second payload, each published number beside ours."""
    return (_table_2(run), _table_3(run), _table_4(run), _second_payload(run), _all_parameters(run))


def print_paper(run: PaperRun, console: Console) -> None:
    """Tables, claims and the verdict."""
    console.print(f"Gautier and Briot (2011), section IV, on the simulated RX-90, seed {run.seed}")
    for table in tables(run)[:4]:
        grid = Table(title=table.title, title_justify="left", title_style="bold", box=None, pad_edge=False)
        for k, column in enumerate(table.columns):
            grid.add_column(column, justify="left" if k == 0 else "right", no_wrap=True)
        for row in table.rows:
            grid.add_row(*row)
        console.print()
        console.print(grid)
    console.print()
    for check in run.checks:
        mark = Text("holds", style="green") if check.holds else Text("FAILS", style="red")
        console.print(Text.assemble(mark, f"  {check.claim}"))
    failed = sum(not check.holds for check in run.checks)
    verdict = Text(f"MISSED: {failed} claims fail.", style="bold red")
    if not failed:
        verdict = Text(f"PASSED: all {len(run.checks)} claims hold.", style="bold green")
    console.print(verdict)


def write_paper(run: PaperRun, folder: Path) -> None:
    """Write `paper.md`, `figure3.png`, `figure3.svg`, `parameters.parquet` and `rows.parquet`.

    Raises:
        OSError: If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _write_figure_3(run, folder)
    (folder / "paper.md").write_text(_markdown(run), encoding="utf-8")
    cases = [*((f"case {k}", case) for k, case in enumerate(run.cases, 1)), ("second payload", run.second)]
    parameters = [
        {"case": name, **asdict(p), "total_std": p.total_std, "essential": p.essential}
        for name, case in cases
        for p in case.parameters
    ]
    pd.DataFrame(parameters).to_parquet(folder / "parameters.parquet", index=False)
    pd.concat([_rows(name, case) for name, case in cases]).to_parquet(folder / "rows.parquet", index=False)


def paper_document(run: PaperRun) -> dict[str, object]:
    """The result of `rx90 paper` as one JSON object."""
    cases = [
        {
            "case": k,
            **_estimate(case, run.payloads[0]),
            "published": {**asdict(printed), "gains": list(published.GAINS) if k == 2 else None},
        }
        for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1)
    ]
    second = {
        **_estimate(run.second, run.payloads[1]),
        "published": {"M": published.SECOND_MASS, "M_2sigma": published.SECOND_MASS_2SIGMA},
    }
    checks = [asdict(check) for check in run.checks]
    return {"cases": cases, "second_payload": second, "checks": checks, "passed": run.passed}


def _estimate(case: PayloadEstimate, true: Array) -> dict[str, object]:
    payload = [
        {
            "parameter": p.name,
            "true": float(value),
            "estimate": p.value,
            "std": p.total_std,
            "tolerance": None,
            "passed": None,
            "known": p.known,
            "essential": p.essential,
        }
        for p, value in zip(case.parameters, true, strict=True)
    ]
    fit = {
        "method": case.method,
        "rows": len(case.system.V),
        "error_norm": case.error_norm,
        "rel_error_norm": case.rel_error_norm,
        "sigma": case.sigma,
    }
    return {"gains": case.gain.tolist(), "payload": payload, "fit": fit}


def _table_2(run: PaperRun) -> PaperTable:
    rows: list[tuple[str, ...]] = []
    for k, (case, printed) in enumerate(zip(run.cases, published.CASES, strict=True), 1):
        for name, value, two_sigma in (("MZ", printed.MZ, printed.MZ_2sigma), ("M", printed.M, printed.M_2sigma)):
            found, true = case[name], run.payloads[0][INERTIAL.index(name)]
            ours = (f"{found.value:.3f}", f"{2 * found.std:.4f}", f"{100 * found.rel_std:.1f} %")
            theirs = (f"{value:.3f}", f"{two_sigma:.4f}", f"{50 * two_sigma / value:.1f} %")
            rows.append((f"case {k} {name}", f"{true:.3f}", *ours, *theirs))
    columns = ("Table 2: payload", "true", "ours", "2 sigma", "rel. sigma", "paper", "2 sigma", "rel. sigma")
    return PaperTable("Table 2: payload parameters with the gains of each case [kg m, kg]", columns, tuple(rows))


def _table_3(run: PaperRun) -> PaperTable:
    rows: list[tuple[str, ...]] = []
    for j, (joint, true) in enumerate(zip(run.gains.joints, run.true_gain, strict=True)):
        ours = ("refused", "-")
        if isinstance(joint, IdentifiedGain):
            ours = (f"{joint.value:.4f}", f"{2 * joint.std:.4f}")
        theirs = ("-", "-")
        if j < IDENTIFIED:
            theirs = (f"{published.GAINS[j]:.4f}", f"{published.GAINS_2SIGMA[j]:.4f}")
        rows.append((f"joint {j + 1}", f"{true:.4f}", *ours, *theirs))
    columns = ("Table 3: gains", "injected", "ours", "2 sigma", "paper", "2 sigma")
    return PaperTable("Table 3: identified drive gains [N m / drive unit]", columns, tuple(rows))


def _table_4(run: PaperRun) -> PaperTable:
    rows = tuple(
        (
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
    return PaperTable(
        "Table 4: error norm, relative norm, sigma, rows less unknowns; ours, then the paper's",
        ("Table 4: fit", *ours, *ours),
        rows,
    )


def _second_payload(run: PaperRun) -> PaperTable:
    found, true = run.second["M"], run.payloads[1][-1]
    row = (
        "M",
        f"{true:.3f}",
        f"{found.value:.3f}",
        f"{2 * found.total_std:.3f}",
        f"{published.SECOND_MASS:.3f}",
        f"{published.SECOND_MASS_2SIGMA:.3f}",
    )
    columns = ("Second payload", "true", "ours", "2 sigma", "paper", "2 sigma")
    return PaperTable("The second payload with the gains of case 2 [kg]", columns, (row,))


def _all_parameters(run: PaperRun) -> PaperTable:
    names = [f"{name} [{UNITS[name]}]" for name in INERTIAL]
    again = run.second.parameters
    rows = tuple(
        (
            label,
            f"{run.payloads[0][k]:.4f}",
            *(f"{e.parameters[k].value:.4f} ± {2 * e.parameters[k].std:.4f}{_mark(e, k)}" for e in run.cases),
            f"{run.payloads[1][k]:.4f}",
            f"{again[k].value:.4f} ± {2 * again[k].total_std:.4f}{_mark(run.second, k)}",
        )
        for k, label in enumerate(names)
    )
    columns = ("Parameter", "true", "case 1", "case 2", "case 3", "second, true", "second")
    title = "All ten parameters, ± 2 sigma; * essential: relative standard deviation under 10 %"
    return PaperTable(title, columns, rows)


def _mark(estimate: PayloadEstimate, k: int) -> str:
    return " *" if estimate.parameters[k].essential else ""


def _markdown(run: PaperRun) -> str:
    parts = ["# Gautier and Briot (2011), section IV, on the simulated RX-90", f"Seed {run.seed}."]
    for table in tables(run):
        lines = [f"## {table.title}", "", _line(table.columns), _line(["---"] * len(table.columns))]
        parts.append("\n".join(lines + [_line(row) for row in table.rows]))
    parts.append("## Figure 3: torques of case 2, measured and reconstructed\n\n![Figure 3](figure3.png)")
    checks = [f"- {'holds' if check.holds else '**fails**'}: {check.claim}" for check in run.checks]
    parts.append("\n".join(["## Claims", "", *checks]))
    return "\n\n".join(parts) + "\n"


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _rows(name: str, case: PayloadEstimate) -> pd.DataFrame:
    system = case.system
    return pd.DataFrame(
        {
            "case": name,
            "joint": system.joint + 1,
            "loaded": system.loaded,
            "t": system.t,
            "measured": case.gain[system.joint] * system.V,
            "reconstructed": case.torque,
        }
    )


def _write_figure_3(run: PaperRun, folder: Path) -> None:
    """Measured and reconstructed torques of joints 1 to 4, both motions one after the other."""
    from matplotlib.figure import Figure

    case = run.cases[1]
    system, measured = case.system, case.gain[case.system.joint] * case.system.V
    end = float(system.t.max())
    figure = Figure(figsize=(10, 9), layout="constrained")
    axes = figure.subplots(IDENTIFIED, 1, sharex=True)
    for j, axis in enumerate(axes):
        for loaded in (False, True):
            rows = (system.joint == j) & (system.loaded == loaded)
            t, torque, model = system.t[rows] + loaded * end, measured[rows], case.torque[rows]
            gaps = np.flatnonzero(np.diff(t) > 1.5 * np.median(np.diff(t))) + 1  # rows left out near reversals
            t, torque, model = (np.insert(x, gaps, np.nan) for x in (t, torque, model))
            axis.plot(t, torque, color="#1f5fa8", lw=1.6, label=None if loaded else "measured, gain times current")
            axis.plot(t, model, color="#d1481f", lw=0.9, label=None if loaded else "reconstructed, W chi")
            axis.plot(t, torque - model, color="#8a8a8a", lw=0.7, label=None if loaded else "difference")
        axis.axvline(end, color="black", lw=0.6, ls=":")
        axis.set_ylabel(f"joint {j + 1} [N m]")
        axis.margins(x=0.01)
    axes[0].set_title("7.025 kg payload", loc="right", fontsize=10)
    axes[0].set_title("bare flange", loc="left", fontsize=10)
    axes[0].legend(loc="upper center", ncols=3, fontsize=8, frameon=False, bbox_to_anchor=(0.5, 1.22))
    axes[-1].set_xlabel("time [s]")
    figure.savefig(folder / "figure3.png", dpi=110)
    figure.savefig(folder / "figure3.svg")
