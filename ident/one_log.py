"""Whether the currents of every log count alike: no log in another unit, of another sign or scale than the first.

`ident.own_torque` says how many times those of the first log a joint's currents of another count. Friction is a second
witness that may change itself, by a third from cold to warm, but never changes its sign or grows tenfold.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.errors import Contradiction, OtherLengths
from ident.own_torque import Scale, own_scales
from ident.problem import Problem

FACTOR = 3.0
"""Factor from which currents are in another unit, whatever friction may do."""
FACTOR_EVIDENCE = 20.0
"""Logarithm of the likelihood ratio that it takes; other currents fit a third or three times on no clean log."""
FRICTION_FACTOR = 2.0
"""Factor of friction that agrees with it."""
SIGN_Z = 5.0
"""Deviations below zero from which a scale is negative."""
SAME_FRICTION = 0.3
"""Share of a friction that is left of it on the warmest day; a negative one is of another sign."""
AMOUNT = 0.07
"""Relative difference of scales that is worth a refusal: friction between weeks differs by as much."""
WITNESSED_Z, ALIKE_Z = 3.5, 2.5
"""Deviations of a scale from 1 that it takes where friction says the same, and that it may differ from friction.

The arm's own torque alone reached 5.3 on sound recordings with weeks between them, friction saying otherwise.
"""
DRIFT = 0.5 * AMOUNT
"""What friction itself may drift meanwhile: it says a scale no better, however surely the arm's own torque does."""
COMMON_Z, COMMON_SPREAD = 3.5, 0.1
"""The same of one scale of all joints, and how far each joint's friction may be from it."""
ALONE, DOUBTFUL_Z = 5.0, 1.5
"""How many times the others' spread one joint's friction must be off, and deviations of the scale, for a note."""
BLIND = 3.0 * AMOUNT
"""How far one joint's friction must be off alone for a note where its own torque is too faint to say anything.

Load that friction grows with moves a sliding joint's by 0.14 on sound logs.
"""
LEAST_SPREAD = 0.01
"""Of the friction of the others."""
ADVICE = "bring both logs to one unit and sign"


@dataclass(frozen=True, slots=True, kw_only=True)
class Counting:
    """What each joint says of the currents of one log beside those of the first.

    Attributes:
        first: Name of the first log.
        second: Name of the other.
        scales: One of each joint that shows it.
    """

    first: str
    second: str
    scales: tuple[Scale, ...]


def countings(problem: Problem, names: Sequence[str], *, bare: bool = False) -> list[Counting]:
    """Every motion beside the first bare one, or the first of all.

    Args:
        problem: Motions and payloads.
        names: Of their logs.
        bare: Whether all surely have a bare flange; if not, one without a payload may carry what nobody stated.
    """
    first = next((k for k, motion in enumerate(problem.motions) if motion.payload is None), 0)
    return [
        Counting(first=names[first], second=names[k], scales=tuple(own_scales(problem, first, k, bare=bare)))
        for k in range(len(problem.motions))
        if k != first
    ]


def alike(problem: Problem, names: Sequence[str], wired: Callable[[], None], *, bare: bool = False) -> list[Counting]:
    """Refuse logs that count currents otherwise than the first; units before the wiring, which they would upset.

    Args:
        problem: Motions and payloads.
        names: Of their logs.
        wired: What else makes sure that the logs are of this arm.
        bare: As in `countings`.

    Returns:
        What each log says, for `scale_notes`.

    Raises:
        Contradiction: Naming log, joints and factor; or what `wired` raises.
    """
    found = countings(problem, names, bare=bare)
    check_units(found)
    try:
        wired()
    except OtherLengths:
        check_scales(found)
        raise
    check_scales(found)
    return found


def check_units(found: Sequence[Counting]) -> None:
    """Refuse logs whose currents are in different units, or several of whose currents have different signs.

    Raises:
        Contradiction: Naming log, joints and factor.
    """
    for each in found:
        far = [scale for scale in each.scales if _far(scale)]
        if far:
            raise Contradiction(
                f"{each.second}: {_counted(far)} those of {each.first} by the arm's own torque and friction; {ADVICE}"
            )
        turned = [scale for scale in each.scales if _turned(scale)]
        if len(turned) > 1:
            raise Contradiction(_turned_words(each, turned))


def check_scales(found: Sequence[Counting]) -> None:
    """Refuse logs one of whose currents has another sign, or whose currents differ by an amount.

    Raises:
        Contradiction: Naming log, joints and factor.
    """
    for each in found:
        turned = [scale for scale in each.scales if _turned(scale)]
        if turned:
            raise Contradiction(_turned_words(each, turned))
        common = _common(each.scales)
        if common is not None:
            raise Contradiction(
                f"{each.second}: all currents count {common:.3g} times those of {each.first} by the arm's own torque "
                f"and friction; {ADVICE}"
            )
        odd = [scale for scale in each.scales if _odd(scale)]
        if odd:
            raise Contradiction(
                f"{each.second}: {_counted(odd)} those of {each.first} by the arm's own torque and friction alike; "
                f"{ADVICE}"
            )


def scale_notes(found: Sequence[Counting]) -> tuple[str, ...]:
    """A note on every joint whose friction alone changed, where its own torque does not contradict another scale."""
    return tuple(
        f"{each.second}: friction of joint {scale.joint + 1} alone is {scale.friction:.3g} times that in {each.first}, "
        f"and the arm's own torque {_own_words(scale)}: did friction change, or has one log another scale? The gain is "
        "as wrong as that"
        for each in found
        for scale in each.scales
        if _doubtful(scale, each.scales)
    )


def _own_words(scale: Scale) -> str:
    if not _leans(scale):
        return f"of v{scale.joint + 1} is too faint to tell"
    return f"would have v{scale.joint + 1} count {scale.value:.3g} times"


def _leans(scale: Scale) -> bool:
    """Whether the arm's own torque is for another scale."""
    return abs(scale.value - 1.0) > DOUBTFUL_Z * scale.std


def _doubtful(scale: Scale, scales: Sequence[Scale]) -> bool:
    others = [each.friction for each in scales if each.friction is not None and each is not scale]
    if scale.friction is None or len(others) < 2:
        return False
    middle = float(np.median(others))
    spread = max(LEAST_SPREAD, float(np.median(np.abs(np.array(others) - middle))))
    off = scale.friction - middle
    alone = abs(off) > max(ALONE * spread, AMOUNT)
    if ALIKE_Z * scale.std > BLIND and not _leans(scale):
        return alone and abs(off) > BLIND
    same_way = (scale.value - 1.0) * off > 0.0 and _leans(scale)
    return alone and same_way and _alike(scale.value, scale.friction, scale.std)


def _far(scale: Scale) -> bool:
    size = abs(scale.value)
    if not (size > FACTOR or size < 1.0 / FACTOR) or scale.evidence < FACTOR_EVIDENCE:
        return False
    if scale.friction is None:
        return abs(size - 1.0) > SIGN_Z * scale.std
    friction = abs(scale.friction)
    return friction > FRICTION_FACTOR if size > 1.0 else friction * FRICTION_FACTOR < 1.0


def _turned(scale: Scale) -> bool:
    if scale.friction is None:
        return scale.value < -SIGN_Z * scale.std
    return scale.value < 0.0 and scale.friction < -SAME_FRICTION


def _odd(scale: Scale) -> bool:
    """Whether own torque and friction say alike that the currents of one joint count more, or less."""
    if scale.friction is None:
        return False
    far = abs(scale.value - 1.0) > WITNESSED_Z * scale.std and abs(scale.friction - 1.0) > AMOUNT
    return far and _alike(scale.value, scale.friction, scale.std)


def _alike(value: float, friction: float, std: float) -> bool:
    """Whether a scale by the arm's own torque, and its deviation, are what friction says."""
    return abs(value - friction) < max(ALIKE_Z * std, DRIFT)


def _common(scales: Sequence[Scale]) -> float | None:
    """One factor of all currents, where their own torque and friction say it alike."""
    value, weight = np.array([each.value for each in scales]), np.array([each.std**-2.0 for each in scales])
    friction = np.array([np.nan if each.friction is None else each.friction for each in scales])
    if len(scales) < 2 or not np.isfinite(friction).all():
        return None
    pooled, std = float(value @ weight / weight.sum()), float(weight.sum() ** -0.5)
    middle = float(np.median(friction))
    sure = abs(pooled - 1.0) > COMMON_Z * std and abs(middle - 1.0) > AMOUNT
    together = bool((np.abs(friction / middle - 1.0) < COMMON_SPREAD).all())
    return pooled if sure and _alike(pooled, middle, std) and together else None


def _counted(scales: Sequence[Scale]) -> str:
    return ", ".join(f"v{each.joint + 1} counts {each.value:.3g} times" for each in scales)


def _turned_words(each: Counting, turned: Sequence[Scale]) -> str:
    columns = ", ".join(f"v{scale.joint + 1}" for scale in turned)
    return (
        f"{each.second}: {columns} {'has' if len(turned) == 1 else 'have'} the other sign than in {each.first} by the "
        f"arm's own torque and friction (or q{turned[0].joint + 1} has); {ADVICE}"
    )
