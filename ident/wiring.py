"""Whether a log is of the arm as it is wired, numbered and mounted: no other reading of it may explain it better.

A wrong sign, zero, column or base leaves a larger part of the currents unexplained than the right one, whatever the
parameters. Readings are compared by the logarithms of what they leave, in sum over the joints, first on few instants,
those that look better on more.
"""

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from ident.arm import Arm
from ident.borne_out import CLEAR, borne_out
from ident.errors import Contradiction, OtherLengths
from ident.evidence import among_best, convincing, evidence_of, gain_over
from ident.explanation import Explanation, Unknowns, explanations, unknowns_of, unknowns_under_any
from ident.instants import Instants, calmer, instants
from ident.observation import ObserveOptions
from ident.one_log_readings import agree, one_log_explanations
from ident.readings import WEIGHTLESS, Reading, readings
from ident.recording import Recording
from ident.scale_of_lengths import scaled_lengths, searched
from ident.structure import Structure
from ident.tilt import shown_by_several, tilt

FEW, MANY = 120, 400
"""Instants of each motion that all readings, and those that look better, are compared on."""
LOOKS_BETTER = 0.02
"""Sum of logarithms by which a reading must be better on few instants to be looked at again."""
NAMED = 3
"""Equally good readings that a message names."""

WiringCheck: TypeAlias = Callable[[Structure, Recording, Recording, ObserveOptions], None]
"""Structure, unloaded and loaded motion, filters; raises if the log is of another arm."""


def known_wiring(structure: Structure, unloaded: Recording, loaded: Recording, options: ObserveOptions) -> None:
    """Trust the log: for arms that are simulated, or have been checked before."""


def check_wiring(structure: Structure, unloaded: Recording, loaded: Recording, options: ObserveOptions) -> None:
    """Refuse recordings that one mistake in signs, zeros, columns or base explains better than none.

    Args:
        structure: Of the arm that is said to have moved.
        unloaded: Motion with a bare flange, long enough for the filters.
        loaded: Motion with the payload mounted, likewise.
        options: Filters.

    Raises:
        Contradiction: Naming the readings that explain the currents best, and the joint that shows it most.
        OtherLengths: If other lengths explain them best.
    """
    families = list(readings(structure.arm))
    unknowns = unknowns_of(structure), unknowns_under_any(structure)
    given, *others = _explained(structure.arm, unknowns, (unloaded, loaded), options, FEW, families)
    better = [each.reading for each in others if gain_over(given.left, each.left).sum() > LOOKS_BETTER]
    families = [(given.reading,), *(tuple(each for each in family if each in better) for family in families)]
    given, *others = _explained(structure.arm, unknowns, (unloaded, loaded), options, MANY, families)
    seen = [instants(each, MANY, options) for each in (unloaded, loaded)]
    calm = [instants(each, MANY, calmer(options)) for each in (unloaded, loaded)]
    sure = _of_all_logs(structure.arm, unknowns, (seen, calm), given, others)
    sure += _of_one_log(structure.arm, unknowns, seen, (unloaded, loaded), given, sure)
    if sure:
        lengths = bool((_best(given, sure).reading.stretch != 1.0).any())
        raise (OtherLengths if lengths else Contradiction)(_message(given, sure))


def _of_all_logs(
    arm: Arm,
    unknowns: tuple[Unknowns, Unknowns],
    at: tuple[Sequence[Instants], Sequence[Instants]],
    given: Explanation,
    others: Sequence[Explanation],
) -> list[Explanation]:
    """Readings of all logs that are surely better, the best one first; lengths and the base by what is searched."""
    seen, calm = at
    scaled = scaled_lengths(arm, unknowns[0], seen, calm)
    better = [*(each for each in others if not searched(each.reading, scaled)), *scaled]
    sure = [each for each in better if _surely_better(given, each) and _proven(arm, unknowns, seen, given, each)]
    sure.sort(key=lambda each: -float(gain_over(given.left, each.left).sum()))
    lean = tilt(arm, unknowns[1], seen, [each.reading for each in sure], suspected=bool(sure))
    return sure if lean is None or not shown_by_several(given, lean) else [*sure, lean]


def _of_one_log(
    arm: Arm,
    unknowns: tuple[Unknowns, Unknowns],
    seen: Sequence[Instants],
    recordings: Sequence[Recording],
    given: Explanation,
    sure: Sequence[Explanation],
) -> list[Explanation]:
    """Readings of one log alone that are surely better; none are looked for where one of all logs lets them agree."""
    ordinary = [each for each in sure if (each.reading.stretch == 1.0).all()]
    if ordinary:
        reading = _best(given, ordinary).reading
        if agree(arm, unknowns[reading.gravity is not arm.gravity], seen, reading):
            return []
    found = one_log_explanations(arm, unknowns[0], seen, recordings, given)
    return [each for each in found if _surely_better(given, each)]


def _explained(
    arm: Arm,
    unknowns: tuple[Unknowns, Unknowns],
    motions: Sequence[Recording],
    options: ObserveOptions,
    most: int,
    families: Sequence[tuple[Reading, ...]],
) -> list[Explanation]:
    """What each reading explains on at most so many instants of each motion."""
    seen = [instants(motion, most, options) for motion in motions]
    return [
        explanation
        for family in families
        if family
        for explanation in explanations(arm, unknowns[family[0].gravity is not arm.gravity], seen, family)
    ]


def _surely_better(given: Explanation, other: Explanation) -> bool:
    gain = gain_over(given.left, other.left)
    return convincing(gain, evidence_of(gain, given.freedom, other.freedom), other.reading)


def _proven(
    arm: Arm,
    unknowns: tuple[Unknowns, Unknowns],
    seen: Sequence[Instants],
    given: Explanation,
    other: Explanation,
) -> bool:
    """Whether a reading of all logs is better by far, or by what it ought to be."""
    under = unknowns[0], unknowns[other.reading.gravity is not arm.gravity]
    return gain_over(given.left, other.left).sum() > CLEAR or borne_out(arm, under, seen, other.reading)


def _best(given: Explanation, sure: Sequence[Explanation]) -> Explanation:
    return max(sure, key=lambda each: float(gain_over(given.left, each.left).sum()))


def _message(given: Explanation, sure: Sequence[Explanation]) -> str:
    """One line that names the best readings, and the joint that shows it most."""
    gains = [gain_over(given.left, each.left) for each in sure]
    best = [each for each, tied in zip(sure, among_best(gains), strict=True) if tied]
    words = " or ".join(each.reading.words for each in best[:NAMED])
    more = f" or {len(best) - NAMED} more" if len(best) > NAMED else ""
    joint = int(np.argmax(gain_over(given.left, best[0].left)))
    before, after = 100.0 * given.left[joint], 100.0 * best[0].left[joint]
    shown = f"unexplained of joint {joint + 1}'s current then: {after:.2g} instead of {before:.2g} %"
    if words == WEIGHTLESS:
        return (
            f"the currents fit better without the weight of links and payload ({shown}): v is gravity-compensated, and "
            "the weight that gains come from is missing in it; log the motor current, or the whole commanded torque"
        )
    return (
        f"the currents fit another arm better than this one: {words}{more} ({shown}); check signs, zeros "
        "and order of the columns, how the base stands, and the robot model with its couplings"
    )
