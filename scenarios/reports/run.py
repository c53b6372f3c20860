"""Results for people: aligned tables and one verdict line; colour only on a terminal."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from scenarios.judge import GainVerdict
from scenarios.run import Run

LEFT = ("Name", "Verdict", "Passed", "Source")
"""Columns of words."""


def print_run(run: Run, console: Console) -> None:
    """The table of injected against identified gains, the reasons, and the verdict."""
    scenario = run.bench.scenario
    console.print(f"Scenario {scenario.name}, seed {run.seed}: {scenario.table.description}")
    grid = table("Joint", "Injected", "Identified", "2 sigma", "Error", "Tolerance", "Verdict")
    for gain in run.verdict.gains:
        grid.add_row(
            str(gain.joint),
            f"{gain.true:.4f}",
            number(gain.estimate, ".4f"),
            number(None if gain.std is None else 2.0 * gain.std, ".4f"),
            number(None if gain.rel_error is None else 100.0 * gain.rel_error, "+.3f", " %"),
            f"{100.0 * gain.tolerance:.3g} %",
            _verdict(gain),
        )
    console.print(grid)
    _print_notes(console, run.notes)
    for gain in run.verdict.gains:
        if gain.reason is not None:
            console.print(f"Joint {gain.joint}: {gain.reason}.")
    console.print(
        f"{run.estimate.rows} rows, relative residual {100.0 * run.estimate.rel_error_norm:.2f} %; "
        f"simulated in {run.simulate_s:.2f} s, identified in {run.identify_s:.2f} s."
    )
    found = sum(gain.identifiable for gain in run.verdict.gains)
    missed = [str(gain.joint) for gain in run.verdict.gains if not gain.passed]
    if missed:
        console.print(Text(f"MISSED on joint {', '.join(missed)}.", style="bold red"))
    else:
        refused = [str(gain.joint) for gain in run.verdict.gains if not gain.identifiable]
        rest = f"; joint {', '.join(refused)} rightly refused" if refused else ""
        console.print(Text(f"PASSED: {found} gains within tolerance{rest}.", style="bold green"))


def print_estimate(estimate: GainEstimate, notes: Sequence[str], console: Console) -> None:
    """The table of identified gains, the reasons for refusals, and how good the fit is.

    The column `payload` is two standard deviations that the payload's stated uncertainty adds.
    """
    grid = table("Joint", "Name", "Gain", "2 sigma", "payload", "Residual", "Verdict")
    for index, joint in enumerate(estimate.joints, 1):
        gain = joint if isinstance(joint, IdentifiedGain) else None
        share = estimate.residual_share(index - 1)
        grid.add_row(
            str(index),
            joint.joint,
            number(gain and gain.value, ".4f"),
            number(gain and 2.0 * gain.std, ".4f"),
            number(gain and 2.0 * gain.payload_std, ".4f"),
            number(None if share is None else 100.0 * share, ".1f", " %"),
            Text("identified", style="green") if gain else Text("refused", style="yellow"),
        )
    console.print(grid)
    _print_notes(console, notes)
    for index, joint in enumerate(estimate.joints, 1):
        if isinstance(joint, RefusedGain):
            console.print(f"Joint {index}: {joint.reason}.")
    found = int(estimate.identifiable.sum())
    console.print(
        f"{found} of {len(estimate.joints)} gains identified from {estimate.rows} rows, "
        f"relative residual {100.0 * estimate.rel_error_norm:.2f} %."
    )


def table(*columns: str) -> Table:
    """An empty table; names and verdicts stand left, numbers right."""
    grid = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        grid.add_column(column, justify="left" if column in LEFT else "right", no_wrap=True)
    return grid


def _verdict(gain: GainVerdict) -> Text:
    if not gain.passed:
        return Text("MISSED", style="red")
    return Text("passed", style="green") if gain.identifiable else Text("rightly refused", style="green")


def _print_notes(console: Console, notes: Sequence[str]) -> None:
    for note in notes:
        console.print(f"Note: {note}.")


def number(value: float | None, form: str, unit: str = "") -> str:
    """A number with its unit, a dash for none."""
    return "-" if value is None else f"{value:{form}}{unit}"
