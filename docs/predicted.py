"""Writes predicted-budget.md: what `rx90 predict` says beside what `rx90 sensitivity` simulated, from its folders."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from opening import write_page
from threadpoolctl import threadpool_limits

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.schema import Scenario, SourceTable
from scenarios.experiments.files.settings import Value, with_settings
from scenarios.experiments.studies.sensitivity import ALONE, NONE
from scenarios.experiments.studies.sources import settings_with, sources_of
from scenarios.prediction.linear import linearised
from scenarios.prediction.predictor import Predictor, predictor_of
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError

HEAD = """# Predicted and simulated error budgets

Written by `make predicted` from the folders of `rx90 sensitivity`. No number is typed by hand.

Root mean square of the relative error of the gain from each source alone [%]: predicted with the numbers that the
trials drew / simulated, minus the error of the trial with every source off, which is that of the method. Where the
two
differ by more than a tenth and by more than 0.05 %, of a noise also by more than three standard errors of so few
trials, they are **bold**.

Where they differ, the gains are estimated again from the logs that the prediction assumes with the source on, to find
the cause. Either the estimate is not linear in the source, because another model is selected with it than
without it, or a simulated log differs from the assumed one, which has perfect control and no time steps.
"""
SHARE, SMALL, ERRORS = 0.1, 5e-4, 3.0
NOT_LINEAR = "the estimate is not linear in it"
OTHER_LOG = "the simulated log is not the expected one"
AGAIN = 3
"""Trials of a source that does not agree that the estimate is made again for."""
LEAST = 6
"""Trials a source: that many tell an rms to some 30 % (its deviation is 1 / sqrt(2 n) of it)."""


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
    trials = whole(rows, joints)
    if len(trials) < LEAST:
        sys.exit(f"{name}: {len(trials)} trials with a gain on every joint; expected {LEAST} or more; raise --repeats")
    real = np.array([trial.set_index("joint").loc[joints, "rel_error"] for trial in trials]) - own
    simulated = rms(real)
    allowed = np.maximum(SHARE * simulated, SMALL)
    if source.stream is None:
        predicted = rms([predictor.error(source, settings_of(source, trial.iloc[0])) for trial in trials])
        return list(map(Entry, predicted.tolist(), simulated.tolist(), allowed.tolist()))
    std = predictor.noise(source.stream).std
    allowed = np.maximum(allowed, ERRORS * std / np.sqrt(2.0 * len(trials)))
    return list(map(Entry, std.tolist(), simulated.tolist(), allowed.tolist()))


def whole(rows: pd.DataFrame, joints: np.ndarray) -> list[pd.DataFrame]:
    """The trials that have a gain on every joint."""
    trials = (trial for _, trial in rows.groupby("trial"))
    return [trial for trial in trials if trial["rel_error"].notna()[trial["joint"].isin(joints)].all()]


def rms(errors: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(np.square(errors), axis=0))


@dataclass(frozen=True)
class Own:
    """Errors with every source off, of the simulated log and of the expected one."""

    simulated: np.ndarray
    again: np.ndarray


def errors_again(predictor: Predictor, off: Scenario, settings: Mapping[str, Value]) -> np.ndarray:
    """Errors of the estimate that is made of the expected logs at settings, all else off."""
    found = linearised(setup_of(with_settings(off, settings)), predictor.linear.every)
    missing = np.setdiff1d(predictor.joints, found.estimate.solution.joints)
    if missing.size:
        sys.exit(f"joint {missing[0] + 1} has no gain at {dict(settings)}")
    inverse = found.estimate.solution.inverse[np.searchsorted(found.estimate.solution.joints, predictor.joints)]
    return 1.0 / (inverse * found.setup.true_gain[predictor.joints]) - 1.0


def exception(predictor: Predictor, off: Scenario, name: str, found: list[Entry], rows: pd.DataFrame, own: Own) -> str:
    """Where a source differs, and which half of prediction it is that does not hold, by its first trials."""
    trials, joints = whole(rows, predictor.joints + 1)[:AGAIN], predictor.joints + 1
    real = rms([trial.set_index("joint").loc[joints, "rel_error"] - own.simulated for trial in trials])
    drawn = [settings_of(off.table.sources[name], trial.iloc[0]) for trial in trials]
    again = rms([errors_again(predictor, off, settings) - own.again for settings in drawn])
    same = np.abs(again - real) <= np.maximum(SHARE * real, SMALL)
    parts: dict[str, list[str]] = {}
    for k in [k for k, entry in enumerate(found) if entry.off]:
        reason = NOT_LINEAR if same[k] else OTHER_LOG
        parts.setdefault(reason, []).append(f"{joints[k]} ({100 * again[k]:.2f} / {100 * real[k]:.2f})")
    told = "; ".join(f"{reason} on joint {', '.join(each)}" for reason, each in parts.items())
    return f"- {name}: {told}"


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
    off = {name: each for name, each in ranked if any(entry.off for entry in each)}
    lines += ["", f"{len(found) - len(off)} of {len(found)} sources agree on every joint."]
    if off:
        sources = sources_of(scenario)
        quiet = with_settings(sources.scenario, settings_with(sources, {}).settings)
        both = Own(own, errors_again(predictor, quiet, {}))
        lines += [f"Those that do not, with the rms of {AGAIN} trials [%], estimated again / simulated:", ""]
        lines += [
            exception(predictor, quiet, name, each, alone[alone["source"] == name], both) for name, each in off.items()
        ]
    failed = alone[alone["failure"].notna()].drop_duplicates("trial").groupby(["source", "failure"]).size()
    silent += [f"{count} trials of {source} give no gains: {failure}." for (source, failure), count in failed.items()]
    return "\n".join([*lines, "", *silent]) + "\n"


def main(words: list[str]) -> None:
    if not words or len(words) % 2:
        sys.exit("name scenarios, each with the folder of its study behind it")
    pairs = zip(words[::2], words[1::2], strict=True)
    text = "\n".join([HEAD, *(section(load_scenario(name), Path(folder)) for name, folder in pairs)])
    write_page(Path(__file__).parent / "predicted-budget.md", text)


if __name__ == "__main__":
    with threadpool_limits(1):
        main(sys.argv[1:])
