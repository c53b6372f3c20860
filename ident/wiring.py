"""Whether a log is of the arm as it is wired, numbered and mounted: no other reading of it may explain it better.

A wrong sign, zero, column or base leaves a larger part of the currents unexplained than the right one, whatever the
parameters. Readings are compared by the logarithms of what they leave, in sum over the joints, first on few instants,
those that look better on more.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ident.arm import Arm
from ident.arrays import Array
from ident.errors import Contradiction
from ident.explanation import Explanation, Unknowns, explanations, unknowns_of
from ident.instants import instants
from ident.observation import ObserveOptions
from ident.readings import WEIGHTLESS, Reading, readings
from ident.recording import Recording
from ident.structure import Structure, structure_of

FEW, MANY = 120, 400
"""Instants of each motion that all readings, and those that look better, are compared on."""
LOOKS_BETTER = 0.02
"""Sum of logarithms by which a reading must be better on few instants to be looked at again."""
BETTER = 0.05
"""The same on many instants, to be believed whatever their number (`docs/derivations.md`)."""
EVIDENCE, LENGTH_EVIDENCE = 45.0, 25.0
"""Logarithm of the likelihood ratio, of white residuals, that it takes besides, and for another length.

A short log is explained by anything, and what a friction model lacks is not white: a right reading reached 36, none by
other lengths 1.
"""
TIE = 0.01
"""Sum of logarithms within which readings are equally good: they describe one arm, or none can tell."""
NOTHING = 1e-3
"""Share of a current below which nothing is left to explain; filters leave as much of exact data."""
NAMED = 3
"""Equally good readings that a message names."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] along no axis: what no torque shows under it, none shows under any."""

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
    """
    families = list(readings(structure.arm))
    unknowns = _unknowns(structure)
    given, *others = _explained(structure.arm, unknowns, (unloaded, loaded), options, FEW, families)
    better = [each.reading for each in others if _gain(given, each).sum() > LOOKS_BETTER]
    if not better:
        return
    families = [(given.reading,), *(tuple(each for each in family if each in better) for family in families)]
    given, *others = _explained(structure.arm, unknowns, (unloaded, loaded), options, MANY, families)
    convincing = [each for each in others if _convincing(given, each)]
    if convincing:
        raise Contradiction(_message(given, convincing))


def _unknowns(structure: Structure) -> tuple[Unknowns, Unknowns]:
    """What is solved for under the model's own gravity, and under any."""
    own = unknowns_of(structure)
    if not structure.arm.gravity.any():
        return own, own
    return own, unknowns_of(structure_of(replace(structure.arm, gravity=ASLANT)))


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


def _gain(given: Explanation, other: Explanation) -> Array:
    """Logarithm of what the log as it is leaves of each joint's current over what another reading leaves, shape (n,).

    Zero where too few instants tell.
    """
    known = np.isfinite(given.left) & np.isfinite(other.left)
    before, after = (np.where(known, np.maximum(each.left, NOTHING), 1.0) for each in (given, other))
    return np.log(before / after)


def _convincing(given: Explanation, other: Explanation) -> bool:
    gain = _gain(given, other)
    least = EVIDENCE if (other.reading.stretch == 1.0).all() else LENGTH_EVIDENCE
    return bool(gain.sum() > BETTER and gain @ np.minimum(given.freedom, other.freedom) > least)


def _message(given: Explanation, convincing: Sequence[Explanation]) -> str:
    """One line that names the best readings, and the joint that shows it most."""
    gains = [float(_gain(given, each).sum()) for each in convincing]
    best = [each for each, gain in zip(convincing, gains, strict=True) if gain > max(gains) - TIE]
    words = " or ".join(each.reading.words for each in best[:NAMED])
    more = f" or {len(best) - NAMED} more" if len(best) > NAMED else ""
    joint = int(np.argmax(_gain(given, best[0])))
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
