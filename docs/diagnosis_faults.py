"""Faulty logs that a diagnosis must name: every family of faults, put into sound cases."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from diagnosis_belief_faults import gravity_compensated, models, payload_faults
from diagnosis_cases import SoundCase
from diagnosis_column_faults import columns, offsets, orders, scales, signs, zeros
from diagnosis_fault import Fault, Motions, then
from diagnosis_time_faults import clocks, delays, drifts, filters, samples

from ident.model.structure import Structure


@dataclass(frozen=True, slots=True, eq=False)
class FaultyCase:
    """A sound case with a fault in it.

    Attributes:
        case: Without the fault.
        fault: What was done to it.
        motions: As logged, with the specified payloads.
        structure: As specified.
    """

    case: SoundCase
    fault: Fault
    motions: Motions
    structure: Structure

    @property
    def name(self) -> str:
        return f"{self.case.name}; {self.fault.kind}, {self.fault.words}"


def faulty_cases(cases: Iterable[SoundCase], sample: int | None = None) -> Iterator[FaultyCase]:
    """Every case with faults in it, one after the other.

    Args:
        cases: Sound ones.
        sample: Faults of each case, drawn so that kinds are as even as they can be; all if None.
    """
    for case in cases:
        for fault in chosen(faults_of(case), case.name, sample):
            motions, structure = fault.apply(case.motions, case.structure)
            yield FaultyCase(case, fault, motions, structure)


def chosen(faults: Sequence[Fault], seed: str, sample: int | None) -> list[Fault]:
    """Some of the faults, no kind twice before every kind was there."""
    if sample is None:
        return list(faults)
    rng = np.random.default_rng((4409, *seed.encode()))
    order = rng.permutation(len(faults)).tolist()
    round_of: dict[str, int] = {}
    ranked: list[tuple[int, int]] = []
    for k in order:
        ranked.append((round_of.setdefault(faults[k].kind, 0), k))
        round_of[faults[k].kind] += 1
    return [faults[k] for _, k in sorted(ranked, key=lambda pair: pair[0])[:sample]]


def faults_of(case: SoundCase) -> list[Fault]:
    """All faults that fit a case."""
    found = [*delays(case), *filters(case), *zeros(case), *signs(case), *scales(case), *offsets(case), *orders(case)]
    found += [*models(case), *clocks(case), *samples(case), *columns(case), *drifts(case), *payload_faults(case)]
    return [*found, *gravity_compensated(case), *_two_at_once(found)]


def _two_at_once(faults: Sequence[Fault]) -> Iterator[Fault]:
    """Pairs of faults of other kinds, of other joints where they have one."""
    kinds = (
        ("sign of q", "zero"), ("zero", "delay"), ("scale of a current in one log", "zero"),
        ("joints exchanged", "zero in one log"), ("sign of q and v in one log", "delay"), ("zero", "base tilted"),
    )  # fmt: skip
    for a, b in kinds:
        first = next((each for each in faults if each.kind == a), None)
        others = [each for each in faults if each.kind == b and abs(each.value or 0.0) > 4e-3]
        second = next((each for each in others if first is not None and first.joints != each.joints), None)
        if first is None or second is None:
            continue
        joints = tuple(sorted({*first.joints, *second.joints})) if len(second.joints) < 3 else first.joints
        logs = tuple(sorted({*first.logs, *second.logs}))
        words = f"{first.kind}, {first.words}; {second.kind}, {second.words}"
        apply = then(first.apply, second.apply)
        yield Fault("two at once", words, joints, logs, None, "", apply)
