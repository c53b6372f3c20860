"""Writes error-budget.md and its pictures from the folders of `rx90 sensitivity`."""

import json
import math
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from opening import write_page

from scenarios.experiments.studies.budget import BudgetJoint, SourceCost, budgets
from scenarios.experiments.studies.sensitivity import ALONE

HOME = Path(__file__).parent
HEAD = """# Error budgets

Written by `make error-budget` from the folders of `rx90 sensitivity`; no number is typed by hand. Sizes and
distributions of the sources are in `[sources]` of each scenario's file; many are assumed. **A budget is a statement
about those sizes**, and about one method of identification. Replace them by your own before you decide what to improve.

Numbers are root mean squares of the relative error of the gain from each source alone [%], including the error of the
method without any source. "Added up one by one" is the sum of the sources' variances and signed biases: if it equals
"all together", the errors are additive. Predictions of `rx90 predict` for the same sources: [predicted
budgets](predicted-budget.md).
"""
SOBOL = """In brackets the Sobol indices of first and total order with all sources on, from {samples} rows; the 95 %
intervals stand in `budget.parquet` of the study.
"""
ENOUGH = 32
"""Rows from which Sobol indices are shown: of fewer, their intervals are wider than they are."""
SMALL = 5e-4
"""Error under which a source is not worth a row."""
LEADING = 3
"""Sources named for each joint."""


@dataclass(frozen=True)
class Study:
    """A study of a scenario: what it was asked for, and the budget of every joint."""

    name: str
    method: str
    version: str
    asked: str
    trials: int
    failed: int
    least: int
    joints: tuple[BudgetJoint, ...]
    sources: tuple[str, ...]

    @property
    def shows_indices(self) -> bool:
        return min(each.samples for each in self.joints) >= ENOUGH

    def costs(self, source: str) -> list[SourceCost | None]:
        """Of one source, a joint each; None where no trial gave a gain."""
        return [next((cost for cost in each.costs if cost.source == source), None) for each in self.joints]


def read(folder: Path) -> Study:
    told = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    table = told["scenario"]["table"]
    rows = pd.read_parquet(folder / "trials")
    if rows["trial"].nunique() < told["trials"]:
        sys.exit(
            f"{folder}: {rows['trial'].nunique()} of {told['trials']} trials; let the study end: {told['command']}"
        )
    wanted = [j + 1 for j in np.flatnonzero(table["tolerance"]["identifiable"])]
    names = tuple(table["sources"])
    alone = rows[(rows["design"] == ALONE) & rows["source"].isin(names)]
    return Study(
        name=told["scenario"]["name"],
        method=table["identification"]["method"],
        version=told["versions"]["rx90-drive-gain-testbench"],
        asked=f"rx90 sensitivity {told['scenario']['name']} "
        f"--repeats {told['repeats']} --samples {told['samples']} --seed {told['seed']}",
        trials=told["trials"],
        failed=rows[rows["failure"].notna()]["trial"].nunique(),
        least=alone.groupby("source")["trial"].nunique().min(),
        joints=budgets(rows, names, wanted, told["seed"]),
        sources=names,
    )


def cell(cost: SourceCost | None, *, indices: bool) -> str:
    if cost is None:
        return "none"
    text = f"{100 * cost.rms.value:.2f}"
    if indices and cost.first is not None and cost.total is not None:
        text += f" ({cost.first.value:.2f}, {cost.total.value:.2f})"
    return text


def added(cost: SourceCost, floor: float | None) -> float:
    """Root mean square of what a source adds to the error that the method has without any."""
    own = floor or 0.0
    return float(np.sqrt(max(cost.rms.value**2 - 2.0 * cost.bias * own + own**2, 0.0)))


def section(study: Study) -> str:
    worth = {
        name: max(added(cost, joint.floor) for cost, joint in zip(found, study.joints, strict=True) if cost is not None)
        for name in study.sources
        if any(found := study.costs(name))
    }
    shown = sorted((name for name in worth if worth[name] >= SMALL), key=lambda name: -worth[name])
    lines = [
        f"## {study.name}, {study.method}",
        "",
        f"![Error budget of {study.name}](error-budget-{study.name}.png)",
        "",
    ]
    lines += [f"`{study.asked}`, version {study.version}: {study.trials} trials, {study.least} of each source alone."]
    lines += [f"Trials without any gain: {study.failed}.", ""]
    lines += [SOBOL.format(samples=min(each.samples for each in study.joints))] if study.shows_indices else []
    lines += [f"| source | {' | '.join(f'joint {each.joint}' for each in study.joints)} |"]
    lines += ["|---" * (len(study.joints) + 1) + "|"]
    for name in shown:
        lines.append(f"| {name} | {' | '.join(cell(x, indices=study.shows_indices) for x in study.costs(name))} |")
    for title, values in (
        ("every source off", [abs(each.floor or 0.0) for each in study.joints]),
        ("**all together**", [math.nan if each.together is None else each.together for each in study.joints]),
        ("added up one by one", [each.summed for each in study.joints]),
    ):
        lines.append(f"| {title} | {' | '.join(f'{100 * x:.2f}' for x in values)} |")
    small = [name for name in study.sources if name in worth and name not in shown]
    lines += ["", f"Adds less than {100 * SMALL:g} % on every joint: {', '.join(small)}.", ""] if small else [""]
    lines += [leading(each) for each in study.joints]
    return "\n".join(lines) + "\n"


def leading(joint: BudgetJoint) -> str:
    first = sorted(joint.costs, key=lambda cost: -added(cost, joint.floor))[:LEADING]
    told = ", ".join(f"{cost.source} {100 * added(cost, joint.floor):.2f} %" for cost in first)
    return f"- Joint {joint.joint}: most is added by {told}."


def main(folders: list[str]) -> None:
    if not folders:
        sys.exit("name folders of studies")
    studies = {folder: read(Path(folder)) for folder in folders}
    for folder, study in studies.items():
        shutil.copyfile(Path(folder) / "budget.png", HOME / f"error-budget-{study.name}.png")
    write_page(HOME / "error-budget.md", "\n".join([HEAD, *map(section, studies.values())]))


if __name__ == "__main__":
    main(sys.argv[1:])
