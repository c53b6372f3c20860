"""Limits of what logs can reveal: faults that they exclude, and faults that are undetectable.

A small fault is excluded beyond the size at which predictions become significantly worse; a large one if it increases
the residual so much that no other change can compensate.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed, Exclusion
from ident.diagnosis.effects import HeldOutEstimate
from ident.diagnosis.evidence import Fits, log_density_improvement, stacked
from ident.diagnosis.families import FAMILIES, Limit
from ident.diagnosis.hypothesis import Alternative
from ident.diagnosis.search import SHOWN, Survey
from ident.diagnosis.terms import CENTRE
from ident.estimation.intervals import each_z
from ident.support.arrays import Array, Indices, Mask
from ident.support.naming import enumerated

SIZES = np.geomspace(1e-2, 1.0, 41)
"""Tested sizes, in units of the largest one for which the first order is valid."""
FARTHEST = 0.1
"""Largest tested error of a payload's centre [m]."""
QUARTER = 135.0
"""Smallest error of a zero that counts as half a turn [degrees]."""
NAMED = 2
"""Largest number of alternatives that a sentence names."""

LIMITS = tuple((family.name, limit) for family in FAMILIES for limit in family.limits)
"""Names of families, and sizes of theirs that are bounded."""
Sizes: TypeAlias = Mapping[Limit, Mapping[tuple[tuple[int, ...], str], float]]
"""Largest sizes that are not excluded, by joints and unit, where there is a limit."""


def limits_of(seen: Survey, base: HeldOutEstimate | None) -> Diagnosed:
    """Return all that fault-free logs, and an estimate, exclude and cannot reveal."""
    sizes = undetected_sizes(seen)
    return Diagnosed(
        excluded=(*exclusions(seen, sizes, base), *(() if base is None else centres_excluded(base))),
        undetectable=(*undetectable(seen, sizes, base), *undetectable_together(seen, sizes)),
        largest_undetected=None if base is None else largest_undetected(seen, sizes, base),
    )


def bounds(fits: Fits, directions: Sequence[Alternative]) -> list[float | None]:
    """Size beyond which each direction, of one parameter, is excluded, by bisection; None if it is not."""
    score, count = fits.score, len(directions)
    if not count:
        return []
    cross, square = np.zeros((2, count, *score.squares.shape))
    for j, part, which, columns in stacked(fits, [each.columns for each in directions]):
        held = part.predicted(part.without(columns))
        cross[which, j] = (part.held_residual.swapaxes(1, 2) @ held)[:, 0].T
        square[which, j] = np.einsum("brk,brk->bk", held, held).T
    felt = np.asarray(square.any(axis=2))[:, None, :, None]  # (directions, 1, parts, 1): others do not change
    largest, last = np.array([each.largest for each in directions]), len(SIZES) - 1

    def lost(number: Indices) -> Mask:
        x = (largest * SIZES[number])[:, None, None, None] * np.array([1.0, -1.0])[:, None, None]
        moved = score.squares - 2.0 * x * cross[:, None] + x**2 * square[:, None]  # (directions, 2, parts, blocks)
        moved = replace(score, squares=np.where(felt, moved, score.squares))
        return each_z(log_density_improvement(score, moved)).max(axis=1) < -SHOWN

    below, above = np.full(count, -1), np.full(count, last)  # not lost at the first, unless it is -1
    found = lost(above)  # not without an effect: z is 0
    while (above - below > 1).any():
        middle = (below + above) // 2
        worse = lost(np.maximum(middle, 0))
        below, above = np.where(worse, below, middle), np.where(worse, middle, above)
    return [size if lost else None for size, lost in zip((largest * SIZES[above]).tolist(), found, strict=True)]


def undetected_sizes(seen: Survey) -> Sizes:
    """Return the largest size that is not excluded of each kind of small fault; of one log, that of any log."""
    found = {limit: dict[tuple[tuple[int, ...], str], float]() for _, limit in LIMITS}
    own = [(limit, each) for name, limit in LIMITS for each in _of_limit(seen, name, limit)]
    for (limit, each), size in zip(own, bounds(seen.logs.fits, [each for _, each in own]), strict=True):
        unit, scale = _unit(each)
        key, sizes = (each.joints, unit), found[limit]
        sizes[key] = max(sizes.get(key, 0.0), np.inf if size is None else scale * size)
    return {kind: {key: size for key, size in sizes.items() if np.isfinite(size)} for kind, sizes in found.items()}


def _unit(small: Alternative) -> tuple[str, float]:
    """Unit of a small fault, and its size in it per unit of the columns; per cent of a factor."""
    return (small.unit, small.scale) if small.unit else ("%", 100.0)


def _of_limit(seen: Survey, family: str, limit: Limit) -> list[Alternative]:
    kind = family, len(limit.column), 1 if limit.one_log else len(seen.logs.recordings)
    return [each for each in seen.directions if (each.family, len(each.joints), len(each.logs)) == kind]


def exclusions(seen: Survey, sizes: Sizes, base: HeldOutEstimate | None = None) -> Iterator[Exclusion]:
    """Return what the logs exclude, one sentence per family, with the effect of its unit on the gains."""
    for name, limit in LIMITS:
        for unit in dict.fromkeys(unit for _, unit in sizes[limit]):
            same = {joints: _rounded(size) for (joints, at), size in sizes[limit].items() if at == unit}
            named = [f"{size:g}{''.join(f' ({limit.column}{j + 1})' for j in joints)}" for joints, size in same.items()]
            own = [each for each in _of_limit(seen, name, limit) if each.joints in same and _unit(each)[0] == unit]
            yield Exclusion(
                family=name, sentence=f"{limit.words} beyond {', '.join(named)} {unit}{_matters(base, own, unit)}",
                joints=tuple(j for joints in same for j in joints), limit=max(same.values()), unit=unit,
            )  # fmt: skip
    words = {name: sentence for family in FAMILIES for name, sentence in family.excluded.items()}
    for name, sentence in words.items():  # excluded as a whole, or for some joints
        own = [each for each in seen.gross if each.alternative.family == name]
        lost = [each for each in own if each.excluded]
        still = {each.alternative.joints for each in own if not each.excluded}
        joints = sorted({each.alternative.joints for each in own} - still)
        if joints and all(len(each) == 1 for each in joints):
            of_joints = tuple(j for (j,) in joints)
            yield Exclusion(family=name, sentence=sentence.format(joints=_numbers(of_joints)), joints=of_joints)
        elif lost and "{joints}" not in sentence:
            many = "" if len(lost) == len(own) else f" ({len(lost)} of {len(own)} cases)"
            yield Exclusion(family=name, sentence=f"{sentence}{many}")


def centres_excluded(base: HeldOutEstimate) -> Iterator[Exclusion]:
    """Return excluded errors of specified centres of payloads, along any axis."""
    for each in base.payload_errors:
        if each.family == CENTRE and each.prior_std is None:
            columns = base.weighted(each)
            axes = [replace(each, columns=(axis[:, None],), largest=FARTHEST) for axis in columns.T]
            sizes = [np.inf if size is None else size for size in bounds(base.fits, axes)]
            if sizes and max(sizes) < np.inf:
                limit = _rounded(max(sizes) * each.scale)
                moved = _largest_effect(base, list(1e-3 * base.stacked(each.columns).T))  # of a millimetre
                sentence = f"errors of the payload's centre beyond {limit:g} mm (1 mm changes a gain by {moved:.1g} %)"
                yield Exclusion(family=each.family, sentence=sentence, limit=limit, unit=each.unit)


def largest_undetected(seen: Survey, sizes: Sizes, base: HeldOutEstimate) -> str | None:
    """Return the fault within its limit, of 1 % without one, with the largest effect on a gain; None without effect."""
    found = list[tuple[float, str]]()
    for name, limit in LIMITS:
        for each in _of_limit(seen, name, limit):
            unit, scale = _unit(each)
            size = sizes[limit].get((each.joints, unit))
            if size is None and not limit.undetectable:
                continue
            effects = base.effects(base.stacked(each.columns)[:, 0] * ((1.0 if size is None else size) / scale))
            at = "".join(f" ({limit.column}{j + 1})" for j in each.joints)
            words = f"{limit.words} of any size{at}" if size is None else f"{limit.words} up to {size:.2g} {unit}{at}"
            most = max((abs(effect.deviations or 0.0) for effect in effects), default=0.0)
            found.append((most, f"{words}{_matters(base, [each], unit)}"))
    most, words = max(found, default=(0.0, ""))
    return words if most else None


def undetectable(seen: Survey, sizes: Sizes, base: HeldOutEstimate | None = None) -> Iterator[str]:
    """Return faults of single joints, and factors of time and currents, that these logs cannot reveal."""
    open_ones = _of_every_log(seen)
    for j in range(seen.logs.structure.arm.n):
        own = [each for each in open_ones if each.joints == (j,)]
        kinds = [kind for kind in ("sign", "zero", "unit") if any(each.family == kind for each in own)]
        if kinds:
            half = kinds == ["zero"] and all(abs(each.value or 0.0) > QUARTER for each in own)
            yield f"zero of q{j + 1} off by half a turn" if half else f"{enumerated(kinds)} of q{j + 1}"
    for name, limit in sorted(LIMITS, key=lambda own: (own[0], not own[1].column)):
        own = [each for each in _of_limit(seen, name, limit) if (each.joints, "%") not in sizes[limit]]
        if own and limit.undetectable:
            joints = sorted({j for each in own for j in each.joints})
            yield f"{limit.undetectable.format(joints=_numbers(joints))}{_matters(base, own, '%')}"


def undetectable_together(seen: Survey, sizes: Sizes) -> Iterator[str]:
    """Return faults of several joints together that these logs cannot reveal."""
    bounded = {"clock", *(name for name, limit in LIMITS if not limit.column and sizes[limit])}
    words = [each.words for each in _of_every_log(seen) if len(each.joints) != 1 and each.family not in bounded]
    if words:
        more = f", or {len(words) - NAMED} more" if len(words) > NAMED else ""
        yield f"whether {', or '.join(words[:NAMED])}{more}"


def _largest_effect(base: HeldOutEstimate, currents: Sequence[Array]) -> float:
    """Largest change of a gain [%] by any of some currents."""
    return max((abs(effect.percent) for each in currents for effect in base.effects(each)), default=0.0)


def _matters(base: HeldOutEstimate | None, own: Sequence[Alternative], unit: str) -> str:
    """The largest change of a gain by one unit of a small fault, in words; empty without an estimate or a change."""
    if base is None:
        return ""
    moved = _largest_effect(base, [base.stacked(each.columns)[:, 0] / _unit(each)[1] for each in own])
    one = unit.removesuffix("s") if unit == "degrees" else unit
    return f" (1 {one} changes a gain by {moved:.2g} %)" if moved else ""


def _of_every_log(seen: Survey) -> list[Alternative]:
    """Return alternatives for all logs that these do not distinguish from the logs as they are."""
    every = seen.logs.every
    return [each.alternative for each in seen.gross if each.alternative.logs == every and not each.excluded]


def _numbers(joints: Sequence[int]) -> str:
    """Joints, from 0, as `2 to 5` or `2, 4`."""
    numbers = sorted(j + 1 for j in joints)
    if len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(each) for each in numbers)


def _rounded(x: float) -> float:
    """Round to two digits at most."""
    return float(f"{x:.2g}")
