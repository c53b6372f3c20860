"""Writes protocols.md from the studies that `make protocols` leaves: one of each scenario in `docs/protocols`."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from opening import write_page

from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.run import run
from sim.effects.motors import warmed
from sim.experiment import after_warm_up

HOME = Path(__file__).parent
NAMES = tuple(sorted(path.stem for path in (HOME / "protocols").glob("*.toml")))
JOINTS = range(5)
"""Those whose gains the payloads show."""
SLOPE = "plant.errors.gain_by_temperature"
HEAD = """# Recording protocols

Written by `make protocols`, which runs `rx90 monte-carlo` on every scenario of `docs/protocols`; no number in the
tables is typed by hand. Each scenario is `field` with cogging, gains and friction that depend on temperature, and a
protocol
of its own, {trials} seeds, identified by the default method. Its sizes are in the files; the temperature dependence
of friction, the pauses of five minutes for every change of the payload and the temperature rise of the drives are
assumed.
"""
TAIL = """
A gain depends on temperature: magnets weaken as they warm up. **Against the cold drive** compares the gain with the
true one of a cold drive, so warming is an error; **at its own temperature** compares it with the true one in the middle
of the loaded motions of the same run. The second is relevant if the gains are used on a warm robot.
"""
RATIO = """The ratio is that of the rms over all five joints, below 1 if the step helps. The same seeds draw the same
robots before and after, and the interval is a bootstrap of pairs of seeds: if it contains 1, there is no clear effect.
"""


@dataclass(frozen=True)
class Protocol:
    """One study.

    Attributes:
        name: Of its scenario.
        carried: What its motions carry.
        minutes: Time on the robot.
        rise: Temperature rise of the drives in the middle of the loaded motions, on average [K], shape (n,).
        rows: Relative errors of joints 1 to 5 against the cold drive, and dependence on temperature [1/K].
    """

    name: str
    carried: tuple[str, ...]
    minutes: float
    rise: np.ndarray
    rows: pd.DataFrame

    def errors(self, *, cold: bool) -> np.ndarray:
        """Relative errors [%], shape (trials, 5); NaN where a gain was refused."""
        table = self.rows.pivot_table(index="trial", columns="joint", values="rel_error", dropna=False)
        error = table.to_numpy()[:, list(JOINTS)]
        if cold:
            return 100.0 * error
        slope = self.rows.groupby("trial")[SLOPE].first().to_numpy()
        return 100.0 * ((1.0 + error) / (1.0 + np.outer(slope, self.rise[list(JOINTS)])) - 1.0)


def read(name: str, folder: Path) -> Protocol:
    setup = setup_of(load_scenario(str(HOME / "protocols" / f"{name}.toml")))
    rows = pd.read_parquet(folder / name / "trials")
    rows = rows[rows["joint"] <= len(JOINTS)]
    first = setup.experiments[0]
    seconds = first.warm_up + sum(
        e.trajectory.duration + (e.pause if k else 0.0) for k, e in enumerate(setup.experiments)
    )
    return Protocol(name, setup.protocol, seconds / 60.0, temperature_rise(setup), rows)


def temperature_rise(setup: Setup) -> np.ndarray:
    """In the middle of the loaded motions, on average [K], shape (n,); from the currents of one run."""
    done = run(setup, 0)
    rise, seen = np.zeros(done.recordings[0].v.shape[1]), []
    for k, (experiment, recording) in enumerate(zip(done.setup.experiments, done.recordings, strict=True)):
        errors, duration = experiment.plant.errors, experiment.trajectory.duration
        load = np.mean((recording.v / experiment.plant.drives.current_limit) ** 2, axis=0)
        if k == 0 and experiment.warm_up:
            rise = after_warm_up(experiment, recording.v, 1.0)
        if k:
            rise = warmed(errors, rise, 0.0 * load, experiment.pause)
        if experiment.loaded:
            seen.append(warmed(errors, rise, load, 0.5 * duration))
        rise = warmed(errors, rise, load, duration)
    return np.mean(seen, axis=0)


def table(protocols: list[Protocol], *, cold: bool) -> str:
    lines = ["| protocol | minutes | joint 1 | joint 2 | joint 3 | joint 4 | joint 5 | worst, 95 % |", "|" + "---|" * 8]
    for each in protocols:
        errors = each.errors(cold=cold)
        rms = np.sqrt(np.nanmean(errors**2, axis=0))
        worst = np.nanquantile(np.abs(errors), 0.95, axis=0).max()
        numbers = " | ".join(f"{x:.2f}" for x in rms)
        lines.append(f"| {titled(each)} | {each.minutes:.1f} | {numbers} | {worst:.2f} |")
    return "\n".join(lines) + "\n"


def titled(protocol: Protocol) -> str:
    return ("10 min warm-up, " if protocol.name.endswith("-warm") else "") + ", ".join(protocol.carried)


def bought(protocols: dict[str, Protocol]) -> str:
    """What each step buys, per joint: the ratio of squared errors, with an interval from seeds drawn again in pairs."""
    rng = np.random.default_rng(0)
    steps = [
        ("a second bare motion", "pair", "return"),
        ("a second bare motion, warm", "pair-warm", "return-warm"),
        ("a second weight", "return", "two-weights"),
        ("a second weight, warm", "return-warm", "two-weights-warm"),
        ("a warm-up before the pair", "pair", "pair-warm"),
        ("a warm-up before bare, loaded, bare", "return", "return-warm"),
    ]
    lines = ["| what | more minutes | rms of joints 1 to 5, before | after | ratio, 95 % interval |", "|" + "---|" * 5]
    for title, before, after in steps:
        if before not in protocols or after not in protocols:
            continue
        one, two = (protocols[name].errors(cold=False) for name in (before, after))
        both = min(len(one), len(two))
        one, two = one[:both], two[:both]
        draws = rng.integers(0, both, (2000, both))
        ratios = [overall(two[d]) / overall(one[d]) for d in draws]
        low, high = np.quantile(ratios, [0.025, 0.975])
        more = protocols[after].minutes - protocols[before].minutes
        lines.append(
            f"| {title} | {more:.1f} | {overall(one):.2f} | {overall(two):.2f} | "
            f"{overall(two) / overall(one):.2f} ({low:.2f} to {high:.2f}) |"
        )
    return "\n".join(lines) + "\n"


def overall(errors: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(errors**2)))


def main(folder: Path) -> None:
    found = {name: read(name, folder) for name in NAMES if (folder / name / "trials").is_dir()}
    if not found:
        sys.exit(f"{folder}: no studies; run make protocols")
    protocols = list(found.values())
    trials = " to ".join(str(x) for x in sorted({each.rows["trial"].nunique() for each in protocols}))
    refused = {each.name: int((~each.rows["identifiable"].astype(bool)).sum()) for each in protocols}
    text = [
        HEAD.format(trials=trials),
        "## Error of the gain at its own temperature, rms [%]\n",
        table(protocols, cold=False),
        "## Error relative to the gain of the cold drive, rms [%]\n",
        table(protocols, cold=True),
        TAIL,
        "Mean temperature rise then, joints 1 to 5 [K]: "
        + "; ".join(f"{titled(p)} {', '.join(f'{x:.1f}' for x in p.rise[list(JOINTS)])}" for p in protocols)
        + ".\n",
        f"Gains that were refused, of {len(JOINTS)} joints times the seeds: "
        + ", ".join(f"{titled(found[name])} {count}" for name, count in refused.items())
        + ".\n",
        "## Benefit of additional time\n",
        bought(found),
        RATIO,
    ]
    write_page(HOME / "protocols.md", "\n".join(text))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
