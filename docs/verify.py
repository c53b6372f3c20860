"""Writes verify.md and verify.png: what `rx90 verify` says of gains beside their true error, on simulated robots."""

import sys
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from opening import write_page
from simulations import TOGETHER, outcomes_of
from threadpoolctl import threadpool_limits

from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.known_gains import KnownGains, estimated_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.identification import identify
from ident.observation.observation import observe
from ident.payload_identification.payload_estimate import payload_of
from ident.payload_identification.verification import AGREES, DIFFERS, Verification, verified
from ident.preparation import SIMULATED
from ident.recordings.motion import Motion
from ident.support.errors import IdentificationError
from scenarios.experiments.build import Setup
from scenarios.experiments.run import Simulated

HERE = Path(__file__).parent
SCENARIOS = {"nominal": str(HERE / "verify" / "nominal.toml"), "field": "field-two-weights"}
TRIALS = 30
FOUND, WEIGHED = "heavy", "light"
LARGEST = 0.1
"""Largest error that is injected into one joint's gain."""


@dataclass(frozen=True)
class Trial:
    """A robot with its recordings, the gains found from the heavier payload, and the lighter one to weigh."""

    setup: Setup
    recordings: tuple
    gains: KnownGains

    def verified(self, gains: KnownGains) -> Verification:
        payload = self.setup.payloads[WEIGHED]
        unknown = replace(payload, known="none")
        table = self.setup.scenario.table.identification
        motions = tuple(
            ObservedMotion(
                observe(recording, self.setup.structure, table.observe), unknown if carried == WEIGHED else None
            )
            for carried, recording in zip(self.setup.protocol, self.recordings, strict=True)
            if carried != FOUND
        )
        problem = Problem(self.setup.structure, motions, table.gains)
        return verified(payload_of(problem, gains, AllJointsOptions()), payload, gains)


def trial(setup: Setup, recordings: tuple) -> Trial:
    table = setup.scenario.table.identification
    motions = [
        Motion(recording, setup.payloads.get(carried))
        for carried, recording in zip(setup.protocol, recordings, strict=True)
        if carried != WEIGHED
    ]
    found = identify(setup.structure, motions, observing=table.observe, gains=table.gains, policy=SIMULATED)
    return Trial(setup, recordings, estimated_gains(found.estimate))


def rows_of(one: Trial, scenario: str, seed: int) -> list[dict]:
    """Masses with the gains as found, and with an error in one of them."""
    rng = np.random.default_rng((2011, seed))
    off = int(rng.choice(one.gains.joints))
    error = float(rng.uniform(-LARGEST, LARGEST))
    factor = np.where(one.gains.joints == off, 1.0 + error, 1.0)
    wrong = replace(
        one.gains, value=one.gains.value * factor, covariance=one.gains.covariance * np.outer(factor, factor)
    )
    rows = []
    for injected, gains in ((0.0, one.gains), (error, wrong)):
        found = one.verified(gains)
        true = dict(zip(gains.joints.tolist(), gains.value / one.setup.true_gain[gains.joints] - 1.0, strict=True))
        std = dict(zip(gains.joints.tolist(), gains.std / np.abs(gains.value), strict=True))
        rows += [
            {
                "scenario": scenario,
                "seed": seed,
                "injected": injected,
                "injected_joint": off + 1,
                "joint": 0 if each.joint is None else each.joint + 1,
                "gain_error": true.get(each.joint, np.nan),
                "gain_std": std.get(each.joint, np.nan),
                "mass_error": np.nan if each.rel_error is None else each.rel_error,
                "mass_std": np.nan if each.rel_std is None else each.rel_std,
                "verdict": each.verdict,
                "passed": found.passed,
            }
            for each in (found.together, *found.joints)
        ]
    return rows


def simulated(name: str, seeds: range) -> list[dict]:
    rows = []
    for seed, setup, outcome in outcomes_of(SCENARIOS[name], seeds):
        if not isinstance(outcome, Simulated):
            print(f"{name} {seed}: {outcome}")
            continue
        try:
            rows += rows_of(trial(setup, outcome.recordings), name, seed)
        except IdentificationError as error:
            print(f"{name} {seed}: {error}")
    return rows


def all_rows(folder: Path) -> pd.DataFrame:
    """Rows of every trial; what the folder holds is not simulated again."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    for name in SCENARIOS:
        for first in range(0, TRIALS, TOGETHER):
            path = folder / f"{name}-{first}.parquet"
            if not path.is_file():
                with threadpool_limits(1):
                    pd.DataFrame(simulated(name, range(first, first + TOGETHER))).to_parquet(path)
            parts.append(pd.read_parquet(path))
    return pd.concat(parts, ignore_index=True)


PAGE = """# Reliability of a verification

Written by `docs/verify.py` from {trials} simulated robots; no number is typed by hand. On each, gains come from bare
motions and 7.025 kg; a mass of 4.275 kg, not used for identification, is then estimated with these gains, once
unchanged, once with a random error of up to {largest:g} % in one random gain. `nominal` has only noise; `field` is
`field-two-weights`, a robot with load-dependent friction, drift, direction-dependent friction, elastic joints, a tilted
base and wrong kinematics at once, and payloads as weighed.

![True error of each gain against the mass estimated from its joint](verify.png)

| scenario | correlation of both errors | rms difference | its size in estimated standard deviations | false alarms |
|---|---|---|---|---|
{summary}

Correlation, difference and deviations compare the mass from each joint alone with the true error of its gain;
false alarms are the trials without an injected error that did not pass.

Detection rate of a wrong gain, by the size of the injected error:

| scenario | injected | trials | named | another joint named as well |
|---|---|---|---|---|
{named}
"""
BINS = (0.0, 0.02, 0.05, LARGEST)


def summary(name: str, rows: pd.DataFrame) -> str:
    own = rows[(rows.joint > 0) & rows.mass_error.notna()]
    off = own.mass_error - own.gain_error
    clean = rows[rows.injected == 0.0].groupby("seed").passed.first()
    cells = (
        f"{own.mass_error.corr(own.gain_error):.3f}",
        f"{100.0 * np.sqrt(np.mean(off**2)):.2f} %",
        f"{np.sqrt(np.mean((off / own.mass_std) ** 2)):.2f}",
        f"{int((~clean).sum())} of {len(clean)}",
    )
    return f"| {name} | {' | '.join(cells)} |"


def named(name: str, rows: pd.DataFrame) -> list[str]:
    lines, wrong = [], rows[rows.injected != 0.0]
    for low, high in pairwise(BINS):
        some = wrong[(wrong.injected.abs() >= low) & (wrong.injected.abs() < high)]
        differs = some[some.verdict == DIFFERS]
        right = differs[differs.joint == differs.injected_joint].seed.nunique()
        others = differs[(differs.joint != differs.injected_joint) & (differs.joint > 0)].seed.nunique()
        size = f"{100.0 * low:g} to {100.0 * high:g} %"
        lines.append(f"| {name} | {size} | {some.seed.nunique()} | {right} | {others} |")
    return lines


def draw(rows: pd.DataFrame) -> None:
    figure, axes = plt.subplots(1, len(SCENARIOS), figsize=(9.0, 4.4), sharex=True, sharey=True, layout="constrained")
    for axis, name in zip(axes, SCENARIOS, strict=True):
        own = rows[(rows.scenario == name) & (rows.joint > 0) & rows.mass_error.notna()]
        for verdict, colour in ((AGREES, "tab:blue"), (DIFFERS, "tab:red")):
            some = own[own.verdict == verdict]
            axis.errorbar(
                100.0 * some.gain_error, 100.0 * some.mass_error, 200.0 * some.mass_std,
                fmt=".", markersize=4, linewidth=0.5, color=colour, label=verdict,
            )  # fmt: skip
        axis.axline((0.0, 0.0), slope=1.0, color="black", linewidth=0.5)
        axis.set(title=name, xlabel="true error of the gain [%]")
    axes[0].set_ylabel("mass of the joint alone off by [%], 2 sigma")
    axes[0].legend()
    figure.savefig(HERE / "verify.png", dpi=110)


if __name__ == "__main__":
    found = all_rows(Path(sys.argv[1] if len(sys.argv) > 1 else HERE.parent / "out" / "verify"))
    each = {name: found[found.scenario == name] for name in SCENARIOS}
    page = PAGE.format(
        trials=sum(rows.seed.nunique() for rows in each.values()),
        largest=100.0 * LARGEST,
        summary="\n".join(summary(name, rows) for name, rows in each.items()),
        named="\n".join(line for name, rows in each.items() for line in named(name, rows)),
    )
    write_page(HERE / "verify.md", page)
    draw(found)
