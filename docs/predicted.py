"""Writes predicted-budget.md: what `rx90 predict` says beside what `rx90 sensitivity` simulated, from its folders."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from scenarios.errors import ScenarioError
from scenarios.files.loading import load_scenario
from scenarios.files.schema import Scenario, SourceTable
from scenarios.files.settings import Value
from scenarios.prediction.predictor import Predictor, predictor_of
from scenarios.studies.sensitivity import ALONE, NONE
from sim.errors import SimulationError

HEAD = """# Predicted and simulated error budgets

Written by `make predicted` from the folders that `rx90 sensitivity` left. Nothing here is typed by hand.

Root mean square of what each source alone adds to the relative error of the gain [%]: predicted for the numbers that
the trials drew / simulated, less the error of the trial with every source off, which is the method's own. Where the two
differ by more than a tenth and by more than 0.05 %, of a noise also by more than three standard errors of so few
trials, they stand **bold**.
"""
SHARE, SMALL, ERRORS = 0.1, 5e-4, 3.0
LEAST = 8
"""Trials a source; an rms of fewer says nothing."""


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


def entries(predictor: Predictor, name: str, source: SourceTable, rows: pd.DataFrame, own: np.ndarray) -> list[Entry]:
    """One a joint: of what is drawn the errors predicted for each trial's own numbers, of noise its deviation.

    Args:
        predictor: Of the scenario.
        name: Of the source.
        source: Its table.
        rows: Of the trials with this source alone.
        own: Relative error of each joint's gain with every source off.
    """
    joints = predictor.joints + 1
    trials = [
        trial for _, trial in rows.groupby("trial") if trial["rel_error"].notna()[trial["joint"].isin(joints)].all()
    ]
    if len(trials) < LEAST:
        sys.exit(f"{name}: {len(trials)} trials with a gain on every joint; expected {LEAST} or more; raise --repeats")
    real = np.array([trial.set_index("joint").loc[joints, "rel_error"] for trial in trials]) - own
    simulated = np.sqrt(np.mean(real**2, axis=0))
    allowed = np.maximum(SHARE * simulated, SMALL)
    if source.stream is None:
        predicted = np.array([predictor.error(source, settings_of(source, trial.iloc[0])) for trial in trials])
        return list(map(Entry, np.sqrt(np.mean(predicted**2, axis=0)).tolist(), simulated.tolist(), allowed.tolist()))
    std = predictor.noise(name, source.stream).std
    allowed = np.maximum(allowed, ERRORS * std / np.sqrt(2.0 * len(trials)))
    return list(map(Entry, std.tolist(), simulated.tolist(), allowed.tolist()))


def settings_of(source: SourceTable, row: pd.Series) -> dict[str, Value]:
    """What a trial drew of a source."""
    settings: dict[str, Value] = {}
    for place in source.targets:
        numbered = [
            column for column in row.index if column.startswith(f"{place}.") and column.rpartition(".")[2].isdigit()
        ]
        settings[place] = [float(row[column]) for column in numbered] if numbered else row[place]
    return settings


def section(scenario: Scenario, folder: Path) -> str:
    """The comparison of the study of a scenario."""
    predictor = predictor_of(scenario)
    rows = pd.read_parquet(folder / "trials")
    alone = rows[rows["design"] == ALONE]
    own = alone[alone["source"] == NONE].set_index("joint")["rel_error"].reindex(predictor.joints + 1).to_numpy()
    if np.isnan(own).any():
        sys.exit(f"{folder}: no gain of every joint with every source off: what a source adds cannot be told")
    alone = alone[alone["source"].isin(list(scenario.table.sources))]
    found: dict[str, list[Entry]] = {}
    silent: list[str] = []
    for name, source in scenario.table.sources.items():
        try:
            found[name] = entries(predictor, name, source, alone[alone["source"] == name], own)
        except (ScenarioError, SimulationError) as error:
            silent.append(f"Not predicted: {name}: {error}.")
    remarks = predictor.linear.estimate.remarks
    lines = [f"## {scenario.name}, {predictor.linear.estimate.method}", ""]
    lines += [f"{'; '.join(remarks)}.", ""] if remarks else []
    lines += [f"{alone.groupby('source')['trial'].nunique().min()} trials a source or more.", ""]
    lines += [f"With every source off the gains are off by {', '.join(f'{100 * x:+.2f}' for x in own)} %.", ""]
    lines += [f"| source | {' | '.join(f'joint {j + 1}' for j in predictor.joints)} |"]
    lines += ["|---" * (len(predictor.joints) + 1) + "|"]
    ranked = sorted(found.items(), key=lambda item: -max(entry.simulated for entry in item[1]))
    lines += [f"| {name} | {' | '.join(map(str, each))} |" for name, each in ranked]
    off = [name for name, each in ranked if any(entry.off for entry in each)]
    return "\n".join([*lines, "", f"Off: {', '.join(off)}." if off else "None is off.", *silent]) + "\n"


def main(words: list[str]) -> None:
    if not words or len(words) % 2:
        sys.exit("name scenarios, each with the folder of its study behind it")
    pairs = zip(words[::2], words[1::2], strict=True)
    text = "\n".join([HEAD, *(section(load_scenario(name), Path(folder)) for name, folder in pairs)])
    (Path(__file__).parent / "predicted-budget.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    with threadpool_limits(1):
        main(sys.argv[1:])
