"""Writes predicted-budget.md: what `rx90 predict` says beside what `rx90 sensitivity` simulated, from its folders."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from scenarios.files.loading import load_scenario
from scenarios.files.schema import Scenario
from scenarios.prediction.budget import PredictedBudget, predicted_budget
from scenarios.studies.sensitivity import ALONE

HEAD = """# Predicted and simulated error budgets

Written by `make predicted` from the folders that `rx90 sensitivity` left. Nothing here is typed by hand.

Root mean square of the relative error of the gain from each source alone [%]: predicted / simulated. A source is off
where the two differ by more than a tenth and by more than 0.05 %, or for a noise, of which a study draws few, by more
than three standard errors: that entry is **bold**.
"""
SHARE, SMALL, ERRORS = 0.1, 5e-4, 3.0


@dataclass(frozen=True)
class Entry:
    """A source and joint: rms predicted and simulated, and what they may differ by."""

    predicted: float
    simulated: float
    allowed: float

    @property
    def off(self) -> bool:
        return abs(self.predicted - self.simulated) > self.allowed

    def __str__(self) -> str:
        text = f"{100 * self.predicted:.2f} / {100 * self.simulated:.2f}"
        return f"**{text}**" if self.off else text


def entries(budget: PredictedBudget, rows: pd.DataFrame, noises: set[str]) -> dict[str, list[Entry]]:
    """Of each predicted source, one a joint."""
    alone = rows[rows["design"] == ALONE]
    found: dict[str, list[Entry]] = {}
    for cost in budget.costs:
        for joint, predicted in zip(budget.joints + 1, cost.rms, strict=True):
            here = alone[(alone["source"] == cost.source) & (alone["joint"] == joint)]["rel_error"].dropna()
            if not len(here):
                continue
            simulated = float(np.sqrt(np.mean(here**2)))
            allowed = max(SHARE * simulated, SMALL)
            if cost.source in noises:
                allowed = max(allowed, ERRORS * predicted / np.sqrt(2.0 * len(here)))
            found.setdefault(cost.source, []).append(Entry(float(predicted), simulated, allowed))
    return found


def section(scenario: Scenario, folder: Path) -> str:
    """The comparison of the study of a scenario."""
    with threadpool_limits(1):
        budget = predicted_budget(scenario)
    noises = {name for name, source in scenario.table.sources.items() if source.stream is not None}
    found = entries(budget, pd.read_parquet(folder / "trials"), noises)
    lines = [f"## {scenario.name}, {budget.method}", ""]
    lines += [f"{'; '.join(budget.remarks)}.", ""] if budget.remarks else []
    lines += [
        f"| source | {' | '.join(f'joint {j + 1}' for j in budget.joints)} |",
        "|---" * (len(budget.joints) + 1) + "|",
    ]
    lines += [f"| {name} | {' | '.join(map(str, each))} |" for name, each in found.items()]
    off = [name for name, each in found.items() if any(entry.off for entry in each)]
    lines += ["", f"Off: {', '.join(off)}." if off else "None is off."]
    lines += [f"Not predicted: {each.source}: {each.reason}." for each in budget.unpredicted]
    return "\n".join(lines) + "\n"


def main(words: list[str]) -> None:
    if not words or len(words) % 2:
        sys.exit("name scenarios, each with the folder of its study behind it")
    pairs = zip(words[::2], words[1::2], strict=True)
    text = "\n".join([HEAD, *(section(load_scenario(name), Path(folder)) for name, folder in pairs)])
    (Path(__file__).parent / "predicted-budget.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
