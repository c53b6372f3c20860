"""Writes checks.md: faults put into recordings one at a time, and what `rx90 check` says of them.

Recordings are simulated at `nominal` noise, of the RX-90 and of a Panda, bare and loaded; the pairs and recordings of a
folder named by REAL_RECORDINGS are checked as they are, and with faults of the same kinds. `--sample K` takes K faults
of each arm, `--clean K` as many clean pairs. What was checked is kept in `--out`: the same command goes on from there,
and `--seconds` ends it early with what there is.
"""

import argparse
import json
import os
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy import stats
from threadpoolctl import threadpool_limits

from ident.arm import load_arm
from ident.arrays import Array
from ident.checks.check import Checked, check
from ident.checks.comparison import same_as_it_is
from ident.checks.remark import Grade
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.recording import Recording
from ident.recording_files import read_recording
from ident.structure import Structure, structure_of
from scenarios.build import bench
from scenarios.files.loading import load_scenario
from scenarios.reports.content import Column, Heading, Paragraph, Part, Report, Table, cells
from scenarios.reports.files import write_markdown
from scenarios.run import Simulated, drawn, motion_streams, simulate_batch

SIMULATED = ("nominal", "panda")
FAULTY_SEED, CLEAN_SEED = 500, 1000
OBSERVING, GAINS = ObserveOptions(), GainOptions()
RATIOS = (79.4, -158.8)
"""Of gears, for positions on the motor's side."""
NEAR = 0.02
"""Relative error of a ratio that counts as named."""
READINGS, LOG = "what the model can explain", "the log itself"
BATCH = 10
REAL = ("ur10e", "ur10e_december", "tx40")

Samples = tuple[Array, Array, Array]
Change = Callable[[Array, Array, Array], Samples]


@dataclass(frozen=True)
class Fault:
    """A mistake of a log.

    Attributes:
        kind: To be counted under.
        words: What was done to the log.
        change: What makes of t, q, v the log with the mistake.
        named: Whether a check names it.
        undone: Words of the reading that undoes it, None where it is no reading.
    """

    kind: str
    words: str
    change: Change
    named: Callable[[Checked], bool]
    undone: str | None = None


def reading(words: str) -> Callable[[Checked], bool]:
    return lambda found: words in found.named


def seen(pattern: str) -> Callable[[Checked], bool]:
    return lambda found: any(
        re.search(pattern, f"{line.topic}: {line.seen}") for line in found.all_remarks if line.grade is not Grade.GOOD
    )


def ratio(j: int, value: float) -> Callable[[Checked], bool]:
    def named(found: Checked) -> bool:
        told = (re.match(rf"q{j + 1} divided by ([-\d.]+)", words) for words in found.named)
        return any(abs(float(each[1].rstrip(".,")) / value - 1.0) < NEAR for each in told if each)

    return named


def column(x: Array, j: int, values: Array) -> Array:
    x = x.copy()
    x[:, j] = values
    return x


def swapped(x: Array, i: int, j: int) -> Array:
    x = x.copy()
    x[:, [i, j]] = x[:, [j, i]]
    return x


def of_joint(j: int) -> Iterator[Fault]:
    """Faults of one joint, from 0, that change what the model can explain."""
    q_, v_ = f"q{j + 1}", f"v{j + 1}"
    for sign, turn in ((-1, 0), (1, 90), (1, 180), (1, 270), (-1, 90), (-1, 180), (-1, 270)):
        words = q_ + (" negated" if sign < 0 else "") + (f" plus {turn} degrees" if turn else "")
        back = turn if sign < 0 else 360 - turn
        undone = q_ + (" negated" if sign < 0 else "") + (f" plus {back} degrees" if turn else "")
        yield Fault(
            "sign of a position" if not turn else "zero by a quarter turn, negated or not",
            words,
            lambda t, q, v, sign=sign, turn=turn: (t, column(q, j, sign * q[:, j] + np.deg2rad(turn)), v),
            reading(undone),
            undone,
        )
    degrees = f"{q_} in degrees"
    yield Fault(
        "one joint in degrees",
        degrees,
        lambda t, q, v: (t, column(q, j, np.rad2deg(q[:, j])), v),
        reading(degrees),
        degrees,
    )
    for value in RATIOS:
        yield Fault(
            "one joint on the motor's side",
            f"{q_} times {value:g}",
            lambda t, q, v, value=value: (t, column(q, j, value * q[:, j]), v),
            ratio(j, value),
        )
    yield Fault(
        "speed in place of a current",
        v_,
        lambda t, q, v: (t, q, column(v, j, np.gradient(q[:, j], t))),
        seen(rf"{v_} is the speed"),
    )


def of_pair(i: int, j: int) -> Iterator[Fault]:
    """Faults of two joints, from 0."""
    a, b = i + 1, j + 1
    yield Fault(
        "positions exchanged",
        f"q{a} and q{b}",
        lambda t, q, v: (t, swapped(q, i, j), v),
        reading(f"columns q{a} and q{b} exchanged"),
        f"columns q{a} and q{b} exchanged",
    )
    yield Fault(
        "currents exchanged",
        f"v{a} and v{b}",
        lambda t, q, v: (t, q, swapped(v, i, j)),
        reading(f"columns v{a} and v{b} exchanged"),
        f"columns v{a} and v{b} exchanged",
    )
    yield Fault(
        "joints exchanged",
        f"{a} and {b}",
        lambda t, q, v: (t, swapped(q, i, j), swapped(v, i, j)),
        reading(f"joints {a} and {b} exchanged"),
        f"joints {a} and {b} exchanged",
    )
    yield Fault(
        "a column twice",
        f"q{a} in place of q{b}",
        lambda t, q, v: (t, column(q, j, q[:, i]), v),
        seen(rf"q{a} and q{b} hold the same|q{b} and q{a} hold the same"),
    )


def of_all() -> Iterator[Fault]:
    """Faults of all joints."""
    yield Fault(
        "all in another order",
        "reversed",
        lambda t, q, v: (t, q[:, ::-1], v[:, ::-1]),
        reading("joints in reverse order"),
    )
    yield Fault(
        "all in another order",
        "shifted by one",
        lambda t, q, v: (t, np.roll(q, 1, 1), np.roll(v, 1, 1)),
        lambda found: any(words.startswith("joints shifted") for words in found.named),
    )
    for unit, factor in (("in degrees", 180.0 / np.pi), ("in revolutions", 0.5 / np.pi)):
        yield Fault(
            "all in another unit",
            unit,
            lambda t, q, v, factor=factor: (t, factor * q, v),
            reading(f"all positions {unit}"),
        )


def of_log(n: int) -> Iterator[Fault]:
    """Faults that no reading undoes."""
    for j in range(n):
        yield Fault(
            "sign of a current",
            f"v{j + 1} negated",
            lambda t, q, v, j=j: (t, q, column(v, j, -v[:, j])),
            seen(rf"friction of joint {j + 1} drives"),
        )
        yield Fault(
            "clipping",
            f"v{j + 1} at 0.8 of its largest",
            lambda t, q, v, j=j: (t, q, column(v, j, _clipped(v[:, j]))),
            seen(rf"v{j + 1} stays at"),
        )
        yield Fault(
            "wrapped angle",
            f"q{j + 1}",
            lambda t, q, v, j=j: (t, column(q, j, (q[:, j] - q[:, j].mean()) % (2 * np.pi)), v),
            seen(r"values: .*wrapped"),
        )
    for late in (0.01, 0.02, 0.03):
        yield Fault(
            "currents late", f"{1e3 * late:g} ms", lambda t, q, v, late=late: _late(t, q, v, late), seen("delay")
        )
    yield Fault("lost samples", "1 %", lambda t, q, v: _kept(t, q, v, even=False), seen("missing samples"))
    yield Fault("lost samples", "1 %, time even", lambda t, q, v: _kept(t, q, v, even=True), seen("lost samples"))
    yield Fault("lost samples", "a hole of 2.5 %", _hole, seen("missing samples"))
    yield Fault("repeated samples", "1 %", _repeated, seen("repeated samples"))
    yield Fault(
        "time in milliseconds", "", lambda t, q, v: (1e3 * t, q, v), seen("values: .*milliseconds|too slow for")
    )
    yield Fault(
        "a spike",
        "in q2",
        lambda t, q, v: (t, column(q, 1, q[:, 1] + 1.0 * (np.arange(len(t)) == 700)), v),
        seen("values: q2"),
    )


def _clipped(v: Array) -> Array:
    limit = 0.8 * float(np.abs(v).max())
    return np.clip(v, -limit, limit)


def _late(t: Array, q: Array, v: Array, late: float) -> Samples:
    rows = round(late * (len(t) - 1) / (t[-1] - t[0]))
    return t[rows:], q[rows:], v[:-rows]


def _kept(t: Array, q: Array, v: Array, *, even: bool) -> Samples:
    kept = np.random.default_rng(7).random(len(t)) > 0.01
    return t[: kept.sum()] if even else t[kept], q[kept], v[kept]


def _hole(t: Array, q: Array, v: Array) -> Samples:
    left, right = round(0.45 * len(t)), round(0.475 * len(t))
    t, q, v = (np.concatenate((x[:left], x[right:])) for x in (t, q, v))
    return t, q, v


def _repeated(t: Array, q: Array, v: Array) -> Samples:
    again = np.random.default_rng(8).random(len(t)) < 0.01
    rows = np.maximum(np.arange(len(t)) - again, 0)
    return t, q[rows], v[rows]


def model_faults(n: int) -> list[Fault]:
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    found = [fault for j in range(n) for fault in of_joint(j)]
    found += [fault for i, j in pairs for fault in of_pair(i, j)]
    return [*found, *of_all()]


def base_structures(structure: Structure) -> Iterator[tuple[str, Structure, str]]:
    """The arm with a base that the model has otherwise: which way, the model, the reading that undoes it."""
    for way in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)):
        arm = replace(structure.arm, gravity=np.linalg.norm(structure.arm.gravity) * np.array(way))
        yield f"model's gravity along {way}", structure_of(arm), "gravity along (0, 0, -1) of the base"


@dataclass(frozen=True)
class Outcome:
    """What became of a fault."""

    of: str
    about: str
    kind: str
    words: str
    found: bool
    named: bool
    seconds: float | None


@dataclass(frozen=True)
class Clean:
    """What a check said of one clean set of recordings."""

    of: str
    words: str
    wrong: bool
    weak: list[str]


class Kept:
    """Outcomes in a file, a line each; a run that was ended goes on."""

    def __init__(self, path: Path, until: float) -> None:
        self.path, self.until = path, until
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        self.rows = {(row["of"], row.get("kind"), row["words"]): row for row in map(json.loads, lines)}

    def of(self, key: tuple[str, str | None, str], make: Callable[[], Outcome | Clean]) -> None:
        if key not in self.rows and time.monotonic() < self.until:
            self.rows[key] = asdict(make())
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(self.rows[key]) + "\n")

    def outcomes(self) -> list[Outcome]:
        return [Outcome(**row) for row in self.rows.values() if "kind" in row]

    def clean(self) -> list[Clean]:
        return [Clean(**row) for row in self.rows.values() if "kind" not in row]


def changed(fault: Fault, logs: Sequence[Recording]) -> list[Recording]:
    return [Recording(*fault.change(log.t, log.q, log.v), log.name) for log in logs]


def judged(
    of: str,
    about: str,
    kind: str,
    words: str,
    named: Callable[[Checked], bool],
    logs: Sequence[Recording],
    structure: Structure,
) -> Outcome:
    started = time.perf_counter()
    found = check(logs, structure, observing=OBSERVING, gains=GAINS)
    seconds = time.perf_counter() - started
    outcome = Outcome(of, about, kind, words, found.grade is not Grade.GOOD, named(found), seconds)
    print(f"{of}: {kind}, {words}: {'named' if outcome.named else 'found' if outcome.found else '-'}", flush=True)
    return outcome


def try_faults(kept: Kept, of: str, logs: Sequence[Recording], structure: Structure, sample: int) -> None:
    """Try a sample of the faults that change what the model can explain, and all of the log itself."""
    alike = {each.words for each in same_as_it_is(structure, motions=len(logs))}
    faults = [fault for fault in model_faults(structure.arm.n) if fault.undone not in alike]
    chosen = np.sort(np.random.default_rng(2011).permutation(len(faults))[:sample]).tolist()
    tried = [(READINGS, faults[k]) for k in chosen] + [(LOG, fault) for fault in of_log(structure.arm.n)]
    for about, fault in tried:
        faulty = partial(changed, fault, logs)
        kept.of((of, fault.kind, fault.words), partial(_tried, of, about, fault, faulty, structure))
    for words, other, undone in base_structures(structure):
        named = reading(undone)
        kept.of((of, "base", words), partial(judged, of, READINGS, "base", words, named, logs, other))


def _tried(of: str, about: str, fault: Fault, faulty: Callable[[], list[Recording]], structure: Structure) -> Outcome:
    return judged(of, about, fault.kind, fault.words, fault.named, faulty(), structure)


def simulated(name: str, seeds: Sequence[int]) -> Iterator[tuple[Structure, list[Recording]]]:
    prepared = bench(load_scenario(name))
    for start in range(0, len(seeds), BATCH):
        part = seeds[start : start + BATCH]
        ready = [drawn(prepared, seed) for seed in part]
        streams = [motion_streams(seed, {}, len(prepared.experiments)) for seed in part]
        for _, outcome in simulate_batch(ready, streams, threads=1):
            if isinstance(outcome, Simulated):
                yield prepared.structure, list(outcome.recordings)


def real_sets(folder: Path) -> Iterator[tuple[str, Structure, list[Recording]]]:
    ur = structure_of(load_arm(folder / "ur10e" / "ur10e.urdf"))
    for name in ("ur10e", "ur10e_december"):
        yield name, ur, [read_recording(folder / name / f"{each}.parquet") for each in ("unloaded", "loaded")]
    tx40 = structure_of(load_arm(folder / "tx40" / "tx40.urdf", couplings=((4, 5),)))
    yield "tx40", tx40, [read_recording(folder / "tx40" / "recording.parquet")]


def interval(hits: int, of: int) -> str:
    low, high = stats.binomtest(hits, of).proportion_ci(method="exact")
    return f"{100 * low:.1f} to {100 * high:.1f}"


COLUMNS = (
    Column(title="Fault", words=True),
    Column(title="Tried"),
    Column(title="Found"),
    Column(title="Named"),
    Column(title="Named", unit="%"),
    Column(title="95 % interval"),
    Column(title="Not named", words=True),
)


def outcome_table(outcomes: Sequence[Outcome]) -> Table:
    kinds = list(dict.fromkeys(each.kind for each in outcomes))
    rows = [_row(kind, [each for each in outcomes if each.kind == kind]) for kind in kinds]
    return Table(columns=COLUMNS, rows=(*rows, _row("all", outcomes)))


def _row(kind: str, outcomes: Sequence[Outcome]):
    named, missed = sum(each.named for each in outcomes), [each.words for each in outcomes if not each.named]
    listed = ", ".join(missed[:4]) + (f" and {len(missed) - 4} more" if len(missed) > 4 else "")
    return cells(
        kind,
        str(len(outcomes)),
        str(sum(each.found for each in outcomes)),
        str(named),
        f"{100.0 * named / len(outcomes):.1f}",
        interval(named, len(outcomes)),
        listed if kind != "all" else "",
    )


def try_clean(kept: Kept, count: int) -> None:
    """Check recordings without a fault: the first seeds of each scenario, and the real ones."""
    folder = os.environ.get("REAL_RECORDINGS")
    for name, structure, logs in real_sets(Path(folder)) if folder else ():
        for words, part in [("all", logs), *((f"{k + 1}", [log]) for k, log in enumerate(logs) if len(logs) > 1)]:
            of = f"{name} (real)"
            kept.of((of, None, words), partial(_clean, of, words, part, structure))
    for name in SIMULATED:
        for k, (structure, logs) in enumerate(simulated(name, range(CLEAN_SEED, CLEAN_SEED + count))):
            for which, part in (("bare", logs[:1]), ("bare and loaded", logs)):
                of = f"{name}, {which}"
                seed = str(CLEAN_SEED + k)
                kept.of((of, None, seed), partial(_clean, of, seed, part, structure))


def _clean(of: str, words: str, logs: Sequence[Recording], structure: Structure) -> Clean:
    found = check(logs, structure, observing=OBSERVING, gains=GAINS)
    weak = [line.topic for line in found.all_remarks if line.grade is Grade.WEAK]
    print(f"{of}, {words}: {found.grade.value}", flush=True)
    return Clean(of, words, found.grade is Grade.WRONG, weak)


def clean_table(found: Sequence[Clean]) -> Table:
    columns = (
        Column(title="Clean logs", words=True),
        Column(title="Checked"),
        Column(title="Wrong"),
        Column(title="95 % interval", unit="%"),
        Column(title="Lines that are weak", words=True),
    )
    names = dict.fromkeys(each.of for each in found)
    return Table(
        columns=columns, rows=tuple(_clean_row(name, [each for each in found if each.of == name]) for name in names)
    )


def _clean_row(name: str, found: Sequence[Clean]):
    wrong = sum(each.wrong for each in found)
    weak = Counter(topic for each in found for topic in each.weak)
    listed = ", ".join(f"{topic} {many}" for topic, many in weak.most_common())
    return cells(name, str(len(found)), str(wrong), interval(wrong, len(found)), listed)


ABOUT = (
    "What `rx90 check` finds of faults put into recordings one at a time, and what it says of recordings without. "
    "Simulated pairs, bare and loaded, at nominal noise, nothing known of the payload; faults that the kinematics let "
    "no motion show are left out beforehand (`ident/checks/sameness.py`). Found: some line is not good. Named: a line "
    "says what was done, or the group of readings that are the same with it. No number here is typed by hand."
)


def document(outcomes: Sequence[Outcome], clean: Sequence[Clean]) -> Report:
    parts: list[Part] = []
    for about in (READINGS, LOG):
        for title, arms in (*((name, (name,)) for name in SIMULATED), ("real recordings", REAL)):
            own = [each for each in outcomes if each.about == about and each.of in arms]
            if own:
                parts += [Heading(f"Faults of {about}: {title}"), outcome_table(own)]
    both = [each for each in outcomes if each.about == READINGS and each.of in SIMULATED]
    named = sum(each.named for each in both)
    seconds = [each.seconds for each in outcomes if each.seconds is not None]
    summary = (
        f"Of {len(both)} simulated faults that change what the model can explain {named} were named "
        f"({100 * named / len(both):.1f} %, {interval(named, len(both))} %). A check of a pair took "
        f"{np.median(seconds):.2g} s (median), at most {max(seconds):.2g} s, on a machine that did other work."
    )
    head = [Paragraph(ABOUT), Paragraph(summary)]
    return Report("What a check finds", (*head, *parts, Heading("Clean recordings"), clean_table(clean)), {})


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sample", type=int, default=90)
    parser.add_argument("--real-sample", type=int, default=8)
    parser.add_argument("--clean", type=int, default=50)
    parser.add_argument("--out", type=Path, default=Path("out/checks/outcomes.jsonl"))
    parser.add_argument("--seconds", type=float, default=float("inf"))
    options = parser.parse_args()
    kept, folder = Kept(options.out, time.monotonic() + options.seconds), os.environ.get("REAL_RECORDINGS")
    with threadpool_limits(1):
        try_clean(kept, options.clean)
        for name in SIMULATED:
            for structure, logs in simulated(name, [FAULTY_SEED]):
                try_faults(kept, name, logs, structure, options.sample)
        for name, structure, logs in real_sets(Path(folder)) if folder else ():
            try_faults(kept, name, logs, structure, options.real_sample)
    write_markdown(document(kept.outcomes(), kept.clean()), Path(__file__).parent / "checks.md")


if __name__ == "__main__":
    main()
