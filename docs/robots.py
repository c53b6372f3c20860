"""Writes robots.md: how well the gains of the built-in robots, of arms that nobody designed and of others are found.

Arms of others, whose files are not the project's to keep, are those that `rx90 new-robot` has written into the folders
that are named.
"""

import json
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from opening import write_page

from scenarios.experiments.files.loading import load_scenario

HOME = Path(__file__).parent
sys.path.insert(0, str(HOME.parent / "tests" / "helpers"))
from random_arms import write_random_arm  # noqa: E402

OUT = Path("out") / "robots"
SEEDS = 20
BUILT_IN = ("nominal", "ur10e", "tx40", "panda", "stanford", "yam", "so101", "piper", "openarm")
ARMS = range(10)
SURE = 4.0
HEAD = f"""# Other robots

Written by `make robots`; no number is typed by hand. Each scenario is run with {SEEDS} seeds, one process. Random
arms are those of `tests/helpers/random_arms.py`: five to eight joints, tilted axes, some joints prismatic, no shapes.
They, and model files of others, are run as written by `rx90 new-robot`, with its motion.

**Wanted**: joints whose gain the scenario expects, of a new robot those with a sufficient prediction. **p95**: 95th
percentile of the relative error of the gain of the worst wanted joint. **Wrong**: gains with an error of more than
{SURE:g} of their estimated standard deviations. **Refused**: wanted gains that were refused, of all seeds. Arms of
others are model files that Python packages ship (example-robot-data, robosuite), with the names of the packages.

| Robot | Joints | Wanted | p95 | Wrong | Refused |
|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Row:
    """What came of one robot; a reason where nothing did."""

    name: str
    joints: int = 0
    wanted: int = 0
    p95: float = float("nan")
    wrong: int = 0
    refused: int = 0
    reason: str = ""

    @property
    def text(self) -> str:
        """As a line of the table."""
        if self.reason:
            return f"| {self.name} | {self.reason} | | | | |"
        p95 = f"{100.0 * self.p95:.2f} %"
        return f"| {self.name} | {self.joints} | {self.wanted} | {p95} | {self.wrong} | {self.refused} |"


def command(*words: str) -> str:
    """Last line that a command leaves on stderr, empty if all went well or a tolerance was missed."""
    done = subprocess.run([sys.executable, "-m", "scenarios", *words], capture_output=True, text=True, check=False)
    return done.stderr.splitlines()[-1] if done.returncode not in (0, 1) else ""


def row(name: str, scenario: str, folder: Path) -> Row:
    """Of one scenario, whose trials are kept in a folder."""
    reason = command("monte-carlo", scenario, "-n", str(SEEDS), "--out", str(folder), "--jobs", "1")
    parts = sorted((folder / "trials").glob("*.parquet"))
    if reason or not parts:
        return Row(name, reason=reason or "nothing was written")
    rows = pd.concat(pd.read_parquet(part) for part in parts)
    wants = np.flatnonzero(load_scenario(scenario).table.tolerance.identifiable) + 1
    return row_of(name, rows, wants)


def row_of(name: str, rows: pd.DataFrame, wants: np.ndarray) -> Row:
    """Of the rows of a study; `wants` are the joints, from 1, whose gains the scenario wants."""
    asked = rows[rows.joint.isin(wants)]
    given = asked[asked.identifiable.astype(bool)]
    error = (rows.estimate - rows.true).abs()
    return Row(
        name=name,
        joints=int(rows.joint.max()),
        wanted=len(wants),
        p95=float(given.rel_error.abs().groupby(given.joint).quantile(0.95).max()),
        wrong=int((error > SURE * rows["std"]).sum()),
        refused=len(asked) - len(given),
    )


def undesigned(seed: int, folder: Path) -> Row:
    """Of an arm that nobody designed."""
    name = f"arm {seed} (random)"
    folder.mkdir(parents=True, exist_ok=True)
    scenario = folder / "robot" / "scenario.toml"
    if not scenario.is_file():
        model = write_random_arm(folder, seed)
        if reason := command("new-robot", str(model), "--out", str(scenario.parent), "--jobs", "1"):
            return Row(name, reason=reason)
    return row(name, str(scenario), folder / "study")


def main(others: list[Path]) -> None:
    """Run them all and write the page."""
    found = [row(name, name, OUT / name) for name in BUILT_IN]
    found += [undesigned(seed, OUT / f"arm{seed}") for seed in ARMS]
    found += [row(_name(each), str(each / "scenario.toml"), OUT / f"other-{_name(each)}") for each in others]
    write_page(HOME / "robots.md", HEAD + "\n".join(each.text for each in found) + "\n")
    print(json.dumps([each.text for each in found], indent=1))


def _name(folder: Path) -> str:
    return tomllib.loads((folder / "robot.toml").read_text(encoding="utf-8"))["name"]


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
