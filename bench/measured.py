"""Tables of measured pages, between `<!-- make measured: NAME -->` and `<!-- end -->` in docs/.

`make measured TABLES="robots faults"` writes those that are named. Scenarios and seeds are below; two quiet cores take
at most five minutes for a table.
"""

import sys
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from bench.real import Rows, Table, markdown, rx90
from ident.diagnosis.diagnosis import Severity
from ident.identification import identify
from ident.recordings.recording import Motion, Recording
from ident.support.arrays import Array
from ident.support.errors import IdentificationError
from scenarios import load, load_scenario, predicted_budget

DOCS = Path(__file__).parents[1] / "docs"
BEGIN, END = "<!-- make measured: {} -->", "<!-- end -->"
METHODS, CALLS = ("nls", "ls-2011", "iv"), 6
COMPARED = ("nominal", "paper-noise", "mass-only", "field", "coarse-encoder")
COVERED, TRIALS = ("nominal", "field", "docs/coverage/soft.toml"), 100
CONSTANT = "\n".join(f"{name}_std = 0.0" for name in ("scale", "size", "sign", "position", "time"))
"""Options for gains that are known to be constant."""
ROBOTS, SEEDS = ("nominal", "ur10e", "tx40", "panda", "stanford", "yam"), 20
FAULTY, FAULT_SEEDS = ("nominal", "ur10e", "panda"), range(700, 702)
SMALL = 0.001
"""Relative error of every gain below which a source is not listed."""


def study(scenario: str, trials: int) -> list[Table]:
    """Statistics of each joint of a Monte Carlo study."""
    with TemporaryDirectory() as place:
        return rx90("monte-carlo", scenario, "-n", trials, "--out", Path(place) / "study")["joints"]


def percents(numbers: Sequence[float], form: str = ".2f") -> str:
    """The range of some shares in percent."""
    ends = dict.fromkeys(f"{100.0 * each:{form}}" for each in (min(numbers), max(numbers)))
    return " to ".join(ends)


def methods() -> str:
    """Gains of each method on the same trials."""
    rows: Rows = []
    with TemporaryDirectory() as place:
        words = [f"--method={name}" for name in METHODS]
        compared = rx90("compare", *COMPARED, *words, "-n", CALLS, "--out", Path(place) / "methods")
    for scenario in compared["scenarios"]:
        for each in sorted(scenario["methods"], key=lambda each: METHODS.index(each["method"])):
            found = [f"{100.0 * share:.0f}" for share in (each["score"], *each["solved"][:2])]
            rows.append([scenario["name"], each["method"], *found, each["refused_wrongly"], each["wrong_claims"]])
    shares = ("Score [%]", "Within 1 % [%]", "Within 3 % [%]")
    return markdown(("Scenario", "Method", *shares, "Refused wrongly", "Wrong"), rows)


def budget(name: str) -> str:
    """Rms error of each gain from each source alone, and from all together."""
    joints = rx90("predict", name)["joints"]
    frames = [pd.DataFrame(joint["costs"]).set_index("source") for joint in joints]
    alone = pd.concat([np.hypot(each["bias"], each["std"]) for each in frames], axis="columns")
    whole = [np.hypot(each["bias"].sum(), np.linalg.norm(each["std"])) for each in frames]
    largest = alone.max(axis="columns").sort_values(ascending=False)
    alone = alone.loc[largest[largest >= SMALL].index]
    rows: Rows = [["all together", *(f"**{100.0 * each:.2f}**" for each in whole)]]
    rows += [[source, *(f"{100.0 * each:.2f}" for each in errors)] for source, *errors in alone.itertuples()]
    return markdown(["Source", *(f"Joint {joint['joint']} [%]" for joint in joints)], rows)


def coverage() -> str:
    """Share of gains within two deviations, and the estimated deviation over that of the errors, by joint."""
    rows: Rows = []
    with TemporaryDirectory() as place:
        for k, name in enumerate(("nominal", *COVERED)):
            path, base = Path(place) / f"{k}.toml", name if "/" not in name else DOCS.parent / name
            path.write_text(f'extends = "{base}"\n[identification.options]\n{CONSTANT if k else ""}\n')
            joints = [each for each in study(str(path), TRIALS) if each["cover_2"] is not None]
            width = [each["claimed"] / each["spread"] for each in joints]
            shares = percents([each["p95"] for each in joints]), percents([each["cover_2"] for each in joints], ".0f")
            what = f"{Path(name).stem}, {'constant gains' if k else 'by default'}"
            rows.append([what, len(joints), *shares, f"{min(width):.1f} to {max(width):.1f}"])
    return markdown(("Scenario", "Joints", "95 % of errors below [%]", "Within 2 sigma [%]", "Sigma over std"), rows)


def robots() -> str:
    """Errors of the worst joint, and refused gains, of the built-in robots."""
    rows: Rows = []
    for name in ROBOTS:
        wanted = load_scenario(name).table.tolerance.identifiable
        joints = [each for each, expected in zip(study(name, SEEDS), wanted, strict=True) if expected]
        refused = sum(each["refused"] for each in joints)
        rows.append([name, len(wanted), len(joints), percents([max(each["p95"] for each in joints)]), refused])
    return markdown(("Scenario", "Joints", "With a gain", "95 % below, worst joint [%]", "Refused"), rows)


Logs = Sequence[Motion]


def changed(
    motion: Motion,
    *,
    t: float = 1.0,
    q: Array | float = 0.0,
    turn: Array | float = 1.0,
    v: Array | float = 1.0,
    late: int = 0,
) -> Motion:
    """A log with clock, positions and currents scaled, positions shifted, and currents late by samples."""
    log = motion.recording
    return replace(motion, recording=Recording(t * log.t, turn * log.q + q, np.roll(v * log.v, late, axis=0), log.name))


def faults_of(logs: Logs) -> dict[str, tuple[str, Logs]]:
    """Faults by what they are: what a finding says of it, and the logs."""
    (bare, loaded), rad = logs, np.radians(1.0)
    n, payload = bare.recording.n, loaded.payload
    assert payload is not None

    def joint(number: int, value: float, other: float = 0.0) -> Array:
        return np.where(np.arange(1, n + 1) == number, value, other)

    def both(**change: Any) -> Logs:
        return [changed(each, **change) for each in logs]

    aside = replace(payload, com=tuple(np.add(payload.com, (0.02, 0.0, 0.0))))
    swapped = [replace(a, recording=b.recording) for a, b in ((bare, loaded), (loaded, bare))]
    return {
        "none": ("", logs),
        "zero of q3 off by 3 degrees": ("zero of q3", both(q=joint(3, 3.0 * rad))),
        "zero of q4 off by 2 degrees in one log": ("zero of q4", [bare, changed(loaded, q=joint(4, 2.0 * rad))]),
        "v2 times 1.05 in one log": ("v2 is scaled", [bare, changed(loaded, v=joint(2, 1.05, 1.0))]),
        "all currents times 1.08 in one log": ("all currents are scaled", [bare, changed(loaded, v=1.08)]),
        "currents late by 6 samples": ("later than the positions", both(late=6)),
        "clock 5 % off": ("clock is wrong", both(t=1.05)),
        "sign of q3": ("q3", both(turn=joint(3, -1.0, 1.0))),
        "q5 times 1.02": ("motor 5", both(turn=joint(5, 1.02, 1.0))),
        "payload 20 mm aside": ("centre of mass", [bare, replace(loaded, payload=aside)]),
        "logs exchanged": ("swapped", swapped),
    }


def faults() -> str:
    """Faults put into simulated logs: named, under another name, silent, silent with a gain beyond three deviations."""
    counts = defaultdict[str, Counter[str]](Counter)
    for name in FAULTY:
        scenario = load(name)
        for seed in FAULT_SEEDS:
            simulated = scenario.simulate(seed=seed)
            for what, (said, logs) in faults_of(simulated.logs).items():
                try:
                    found = identify(scenario.arm, logs)
                except IdentificationError as error:
                    counts[what]["named" if said and said in str(error) else "other"] += 1
                    continue
                wrong = any(each.severity is Severity.WRONG for each in found.found.findings)
                off = np.ma.filled(np.abs(found.gain - simulated.truth.gain) > 3.0 * found.std, fill_value=False).any()
                named = said and any(said in each.sentence for each in found.found.findings)
                counts[what]["named" if named else "other" if wrong else "harmful" if off else "silent"] += 1
    kinds = ("named", "other", "silent", "harmful")
    heads = ("Fault", "Named", "Otherwise, or refused", "Silent", "Silent and a gain beyond 3 sigma")
    return markdown(heads, [[what, *(found[kind] for kind in kinds)] for what, found in counts.items()])


TABLES: dict[str, tuple[str, Callable[[], str]]] = {
    "methods": ("methods.md", methods),
    "nominal": ("error-budget.md", partial(budget, "nominal")),
    "field": ("error-budget.md", partial(budget, "field")),
    "coverage": ("coverage.md", coverage),
    "robots": ("robots.md", robots),
    "faults": ("diagnosis.md", faults),
}
"""Documents and functions of tables by name."""


def main(names: Sequence[str]) -> None:
    """Write the named tables, or all."""
    for name in names or TABLES:
        place, function = TABLES[name]
        found = function()  # for minutes
        text = (DOCS / place).read_text(encoding="utf-8")
        before, begin, rest = text.partition(BEGIN.format(name))
        _, end, after = rest.partition(END)
        (DOCS / place).write_text(f"{before}{begin}\n\n{found}\n\n{end}{after}", encoding="utf-8")
        if name == "nominal":
            predicted_budget(load_scenario(name)).plot().savefig(DOCS / "error-budget-nominal.png", dpi=130)


if __name__ == "__main__":
    main(sys.argv[1:])
