"""The log as it is beside every other reading of it: which one explains the currents best, on the same instants."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.arm import Arm
from ident.arrays import Array
from ident.borne_out import CLEAR, borne_out
from ident.checks.further_readings import further_readings
from ident.checks.reach import unreachable
from ident.checks.sameness import Fingerprint, fingerprint, same
from ident.evidence import BETTER, convincing, evidence_of, gain_over
from ident.explanation import Explanation, Unknowns, explanations, unknowns_of, unknowns_under_any
from ident.instants import Instants, calmer, instants
from ident.observation import ObserveOptions
from ident.readings import Reading, as_it_is, readings
from ident.recording import Recording
from ident.scale_of_lengths import scaled_lengths, searched
from ident.structure import Structure
from ident.tilt import shown_by_several, tilt
from ident.wiring import MANY

SUSPECT = 20.0
"""Logarithm of the likelihood ratio from which a reading is worth a word; short or bare real logs reach 35."""
ALIKE = 1e-4
"""Relative difference of what is left that rounding makes of the same spans, and more."""


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """Readings that explain the same, beside the log as it is.

    Attributes:
        readings: One or more that no currents can tell apart, simplest first.
        gain: Logarithm of what the log as it is leaves of each column of currents over what these leave, shape (n,).
        evidence: Logarithm of the likelihood ratio, of white residuals.
        borne_out: Whether the log as it is does as badly as it would if these were true (`ident.borne_out`).
    """

    readings: tuple[Reading, ...]
    gain: Array
    evidence: float
    borne_out: bool

    @property
    def sure(self) -> bool:
        """Whether these are surely better than the log as it is."""
        return self.borne_out and convincing(self.gain, self.evidence, self.readings[0])


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """What readings of some logs explain.

    Attributes:
        given: Of the log as it is.
        unreachable: Joints, from 0, that the log as it is puts where they cannot be.
        same: Readings that explain the same as the log as it is, whatever the motion.
        alternatives: The others that the arm can reach, that with the most evidence first.
    """

    given: Explanation
    unreachable: tuple[int, ...]
    same: tuple[Reading, ...]
    alternatives: tuple[Alternative, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Logs:
    """Logs of one arm, prepared to be read in several ways.

    Attributes:
        structure: Of the arm.
        unknowns: What is solved for under the model's own gravity.
        aslant: The same under any.
        recordings: The first with whatever it carries, others that may carry something else.
        seen: Their instants.
        calm: The same of positions filtered lower.
    """

    structure: Structure
    unknowns: Unknowns
    aslant: Unknowns
    recordings: tuple[Recording, ...]
    seen: tuple[Instants, ...]
    calm: tuple[Instants, ...]

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.structure.arm

    def unknowns_under(self, reading: Reading) -> Unknowns:
        """What is solved for under a reading's gravity."""
        return self.unknowns if reading.gravity is self.arm.gravity else self.aslant

    def explained(self, family: Sequence[Reading]) -> list[Explanation]:
        """What readings of the same states explain."""
        return explanations(self.arm, self.unknowns_under(family[0]), self.seen, family)


def prepared(structure: Structure, recordings: Sequence[Recording], options: ObserveOptions) -> Logs:
    """Logs, ready to be compared.

    Args:
        structure: Of the arm.
        recordings: One or more, each long enough for the filters.
        options: Filters.
    """
    seen = tuple(instants(each, MANY, options) for each in recordings)
    calm = tuple(instants(each, MANY, calmer(options)) for each in recordings)
    return Logs(structure, unknowns_of(structure), unknowns_under_any(structure), tuple(recordings), seen, calm)


def same_as_it_is(structure: Structure, *, motions: int) -> tuple[Reading, ...]:
    """Readings that explain the same as the log as it is, whatever the motion, itself among them.

    Args:
        structure: Of the arm, under whose gravity they are.
        motions: Of the logs that are compared.
    """
    own, arm = unknowns_of(structure), structure.arm
    upright = (each for each in single_readings(arm) if each.gravity is arm.gravity)
    given = fingerprint(structure, own, as_it_is(arm), motions=motions)
    return tuple(each for each in upright if same(given, fingerprint(structure, own, each, motions=motions)))


def compared(logs: Logs, more: Sequence[Reading] = ()) -> Comparison:
    """Compare the log as it is with every reading of it that has one mistake.

    Args:
        logs: The logs.
        more: Further readings to compare with.
    """
    arm = logs.arm
    families = [*_families(arm), *((each,) for each in more)]
    given, *others = (found for family in families for found in logs.explained(family))
    reached = [each for each in others if not unreachable(arm, logs.recordings, each.reading)]
    same_as_given, groups = _grouped(logs, given, reached)
    alternatives = [_alternative(logs, given, group) for group in groups]
    alternatives = _with_tilt(logs, given, _with_factors(logs, given, alternatives))
    return Comparison(
        given=given,
        unreachable=unreachable(arm, logs.recordings, given.reading),
        same=tuple(each.reading for each in same_as_given),
        alternatives=tuple(sorted(alternatives, key=lambda each: -each.evidence)),
    )


def _with_factors(logs: Logs, given: Explanation, others: list[Alternative]) -> list[Alternative]:
    """Alternatives, those of other lengths by the factors that explain most."""
    scaled = scaled_lengths(logs.arm, logs.unknowns, logs.seen, logs.calm)
    kept = [each for each in others if not searched(each.readings[0], scaled)]
    return [*kept, *(_alternative(logs, given, [each]) for each in scaled)]


def _with_tilt(logs: Logs, given: Explanation, others: list[Alternative]) -> list[Alternative]:
    """Alternatives, and a base that stands otherwise if that is worth a word."""
    better = sorted((each for each in others if each.evidence > SUSPECT), key=lambda each: -each.evidence)
    readings = [each.readings[0] for each in better]
    lean = tilt(logs.arm, logs.aslant, logs.seen, readings, suspected=bool(better))
    if lean is None:
        return others
    found = _alternative(logs, given, [lean])
    found = replace(found, borne_out=shown_by_several(given, lean))
    return others if found.evidence < SUSPECT else [*others, found]


def _grouped(
    logs: Logs, given: Explanation, others: Sequence[Explanation]
) -> tuple[list[Explanation], list[list[Explanation]]]:
    """Readings that are the same as the log as it is, and groups of others that are the same.

    What is the same by the kinematics leaves the same of these currents; only where it does, the kinematics are asked.
    """
    groups = [[given]]
    prints: dict[int, Fingerprint] = {}

    def known(each: Explanation) -> Fingerprint:
        if id(each) not in prints:
            unknowns = logs.unknowns_under(each.reading)
            prints[id(each)] = fingerprint(logs.structure, unknowns, each.reading, motions=len(logs.seen))
        return prints[id(each)]

    for each in others:
        for k in _alike(each.column_left, [members[0].column_left for members in groups]):
            if same(known(each), known(groups[k][0])):
                groups[k].append(each)
                break
        else:
            groups.append([each])
    first, *rest = groups
    return first[1:], rest


def _alike(left: Array, others: Sequence[Array]) -> list[int]:
    """Which of others leave the same as one does, of every column."""
    alike = np.isclose(left, np.array(others), rtol=ALIKE, atol=0.0)  # where too few instants tell, all are infinite
    return np.flatnonzero(alike.all(axis=1)).tolist()


def _alternative(logs: Logs, given: Explanation, group: Sequence[Explanation]) -> Alternative:
    gain = gain_over(given.column_left, group[0].column_left)
    evidence = evidence_of(gain, given.column_freedom, group[0].column_freedom)
    reading, better = group[0].reading, float(gain.sum())
    doubtful = BETTER < better <= CLEAR
    unknowns = logs.unknowns, logs.unknowns_under(reading)
    proven = not doubtful or borne_out(logs.arm, unknowns, logs.seen, reading)
    return Alternative(tuple(each.reading for each in group), gain, evidence, proven)


def single_readings(arm: Arm) -> Iterator[Reading]:
    """Every reading with one mistake, the log as it is first."""
    for family in _families(arm):
        yield from family


def _families(arm: Arm) -> list[tuple[Reading, ...]]:
    return [*readings(arm), *further_readings(arm)]
