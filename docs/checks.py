"""Writes checks.md: faults put into recordings one at a time, and what `rx90 check` says of them.

Recordings are simulated at `nominal` noise, of the RX-90 and of a Panda, bare and loaded; the pairs and recordings of a
folder named by REAL_RECORDINGS are checked as they are, and with faults of the same kinds. `--sample K` takes K faults
of each arm, `--clean K` as many clean pairs. What was checked is kept in `--out`: the same command goes on from there,
and `--seconds` ends it early with what there is.
"""

import argparse
import json
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from check_faults import Fault, base_structures, model_faults, of_log, reading
from ident.checks.check import Checked, check
from ident.checks.comparison import same_as_it_is
from ident.checks.remark import Grade
from scipy import stats
from simulations import outcomes_of
from threadpoolctl import threadpool_limits

from ident.arm import load_arm
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.recording import Recording
from ident.recording_files import read_recording
from ident.structure import Structure, structure_of
from scenarios.reports.content import Column, Heading, Paragraph, Part, Report, Table, cells
from scenarios.reports.files import write_markdown
from scenarios.run import Simulated

SIMULATED = ("nominal", "panda")
FAULTY_SEED, CLEAN_SEED = 500, 1000
OBSERVING, GAINS = ObserveOptions(), GainOptions()
READINGS, LOG = "what the model can explain", "the log itself"
CLEAN = 50
"""Clean pairs of each arm, unless another number is said."""
REAL = ("ur10e", "ur10e_december", "tx40")
PAIRS = (*SIMULATED, "ur10e", "ur10e_december")
"""Of which a bare and a loaded motion are checked together."""


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
    for _, prepared, outcome in outcomes_of(name, seeds):
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
    head = [Paragraph(ABOUT), Paragraph(summary(outcomes))]
    tail = [clean_table(clean), *(Paragraph(each) for each in cut_short(clean))]
    return Report("What a check finds", (*head, *parts, Heading("Clean recordings"), *tail), {})


def summary(outcomes: Sequence[Outcome]) -> str:
    """How many simulated faults were named, and how long a check of a pair of logs took."""
    both = [each for each in outcomes if each.about == READINGS and each.of in SIMULATED]
    if not both:
        return "No fault that changes what the model can explain has been tried yet."
    named = sum(each.named for each in both)
    text = (
        f"Of {len(both)} simulated faults that change what the model can explain {named} were named "
        f"({100 * named / len(both):.1f} %, {interval(named, len(both))} %)."
    )
    pairs = [each for each in outcomes if each.of in PAIRS and each.kind != "base"]
    seconds = [each.seconds for each in pairs if each.seconds is not None]
    if not seconds:
        return text
    return (
        f"{text} A check of a pair took {np.median(seconds):.2g} s (median of {len(seconds)}), at most "
        f"{max(seconds):.2g} s, on a machine that did other work."
    )


def cut_short(clean: Sequence[Clean]) -> list[str]:
    """Of which simulated recordings fewer than usual were checked."""
    counts = {f"{name}, {which}": 0 for name in SIMULATED for which in ("bare", "bare and loaded")}
    counts |= {name: sum(each.of == name for each in clean) for name in counts}
    short = [f"{name} {count}" for name, count in counts.items() if count < CLEAN]
    if not short:
        return []
    return [f"The run was ended before {CLEAN} of each simulated kind were checked: {'; '.join(short)}."]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--sample", type=int, default=90)
    parser.add_argument("--real-sample", type=int, default=8)
    parser.add_argument("--clean", type=int, default=CLEAN)
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
