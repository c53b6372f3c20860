"""Faults that logs exclude, and faults that they cannot reveal.

A small fault is excluded beyond the size at which predictions become significantly worse; a large one if it increases
the residual so much that no other change can compensate.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.candidates import SHOWN
from ident.diagnosis.catalog import payload
from ident.diagnosis.comparison import Fits, Score, each_z, gains
from ident.diagnosis.diagnosis import Exclusion
from ident.diagnosis.engine import Survey
from ident.diagnosis.estimate_model import Stated
from ident.diagnosis.screening import Screened
from ident.support.naming import enumerated

SIZES = np.geomspace(1e-2, 1.0, 41)
"""Tested sizes, in units of the largest one for which the first order is valid."""
SURELY_WORSE = 30.0
"""Loss of log-likelihood on subsampled states by which a large alternative is excluded: twice that of z = 4."""
BOUNDED = (
    ("zero", "zeros", "q", False),
    ("delay", "delays of all currents", "", False),
    ("delay", "delays of one current in one log", "v", True),
    ("lengths", "errors of all lengths", "", False),
    ("clock", "errors of the clock", "", False),
    ("current scale", "errors of all currents' scale in one log", "", True),
    ("current scale", "errors of one current's scale in one log", "v", True),
)
"""Families whose excluded sizes are reported: wording, column of the joint concerned ("" for all joints), and whether
they concern one log."""
OPEN = (
    ("clock", False, False, "rate of the clock"),
    ("current scale", True, True, "scale of v{joints} in one log"),
    ("current scale", False, True, "scale of all currents in one log"),
)
"""Families whose sizes are reported if they are not excluded: whether they concern a joint, one log, and wording."""
FARTHEST = 0.1
"""Largest tested error of a payload's centre [m]."""
GROSS = {
    "sign": "opposite sign of q{joints}",
    "current sign": "opposite sign of v{joints} in one log",
    "joint reversed": "q{joints} and v{joints} both negated in one log",
    "order": "exchanged or reordered columns",
    "base": "a different orientation of the base",
    "unit": "a different unit of positions",
    "gravity compensation": "gravity-compensated currents",
}
"""Families that are excluded as a whole or by joint, with their wording."""
SIZED = ("zero", "lengths", "clock", "current scale")
"""Families whose sizes are bounded instead, or that need a second log."""
QUARTER = 135.0
"""Smallest error of a zero that counts as half a turn [degrees]."""
NAMED = 2
"""Largest number of alternatives that a sentence names."""

Sizes: TypeAlias = Mapping[tuple[str, bool, bool], Mapping[tuple[tuple[int, ...], str], float]]
"""Sizes by joints and unit, of each family, by whether they are of single joints, and of one log."""


def bounds(fits: Fits, directions: Sequence[Direction]) -> list[float | None]:
    """Return the size beyond which each direction, of one parameter, is excluded; None if it is not."""
    score, count = fits.score, len(directions)
    cross, square = np.zeros((2, count, *score.squares.shape))
    for j, part in enumerate(fits.parts):
        felt = [(k, own) for k, each in enumerate(directions) if (own := each.columns[j]) is not None]
        if part is not None and felt:
            which, columns = [k for k, _ in felt], np.hstack([own for _, own in felt])
            held = part.predicted(part.fit.without(columns))
            residual = part.predicted(part.fit.residual[:, None])
            cross[which, j] = (residual.swapaxes(1, 2) @ held)[:, 0].T
            square[which, j] = np.einsum("brk,brk->bk", held, held).T
    found: list[float | None] = [None] * count
    for k in np.flatnonzero(square.any(axis=(1, 2))).tolist():
        felt = square[k].any(axis=1)  # other parts do not change
        own = Score(score.squares[felt], score.rows[felt])
        sizes = directions[k].largest * SIZES
        x = np.stack((sizes, -sizes), axis=1)[..., None, None]  # (sizes, 2, 1, 1)
        moved = replace(own, squares=own.squares - 2.0 * x * cross[k, felt] + x**2 * square[k, felt])
        lost = np.flatnonzero((each_z(gains(own, moved)) < -SHOWN).all(axis=-1))  # (sizes, 2, blocks)
        found[k] = float(sizes[lost[0]]) if len(lost) else None
    return found


def exclusions(seen: Survey, sizes: Sizes) -> list[Exclusion]:
    """Return what the logs exclude, one sentence per family.

    Args:
        seen: Comparison with all alternatives.
        sizes: Its `undetected_sizes`.
    """
    found = list[Exclusion]()
    for family, words, column, one_log in BOUNDED:
        own = sizes[family, bool(column), one_log]
        for unit in dict.fromkeys(unit for _, unit in own):
            same = {joints: _rounded(size) for (joints, at), size in own.items() if at == unit}
            limits = ", ".join(f"{size:g}{''.join(f' ({column}{j + 1})' for j in at)}" for at, size in same.items())
            joints, limit = tuple(j for at in same for j in at), max(same.values())
            sentence = f"{words} beyond {limits} {unit}"
            found.append(Exclusion(family=family, sentence=sentence, joints=joints, limit=limit, unit=unit))
    return [*found, *_gross(seen)]


def undetected_sizes(seen: Survey) -> Sizes:
    """Return the largest size of a fault that is not excluded, of each kind in `BOUNDED`, where there is a limit."""
    return {
        (family, bool(column), one_log): _largest(seen, family, of_joints=bool(column), one_log=one_log)
        for family, _, column, one_log in BOUNDED
    }


def _largest(seen: Survey, family: str, *, of_joints: bool, one_log: bool) -> dict[tuple[tuple[int, ...], str], float]:
    """Largest size of a family that is not excluded, by joints and unit; of families of one log, in any log."""
    count = 1 if one_log else len(seen.logs.recordings)
    own = [each for each in seen.directions if each.family == family and len(each.joints) == of_joints]
    own = [each for each in own if len(each.logs) == count]
    found = dict[tuple[tuple[int, ...], str], float]()
    for each, size in zip(own, bounds(seen.logs.model.fits, own), strict=True):
        unit, scale = (each.unit, each.scale) if each.unit else ("%", 100.0)  # of a factor
        found[each.joints, unit] = max(found.get((each.joints, unit), 0.0), np.inf if size is None else scale * size)
    return {key: size for key, size in found.items() if np.isfinite(size)}


def centres_excluded(base: Stated) -> Iterator[Exclusion]:
    """Return excluded errors of specified centres of payloads, along any axis."""
    for each in payload.directions(base.problem, base.estimate):
        if each.family == "payload centre" and each.prior_std is None:
            (columns,) = base.weighted(each).columns
            assert columns is not None, "weighted"
            axes = [replace(each, columns=(axis[:, None],), largest=FARTHEST) for axis in columns.T]
            sizes = [np.inf if size is None else size for size in bounds(base.fits, axes)]
            if sizes and max(sizes) < np.inf:
                limit = _rounded(max(sizes) * each.scale)
                millimetre = 1e-3 * base.stacked(each.columns).T
                moved = max((abs(gain.percent) for axis in millimetre for gain in base.effects(axis)), default=0.0)
                sentence = f"errors of the payload's centre beyond {limit:g} mm (1 mm changes a gain by {moved:.1g} %)"
                yield Exclusion(family=each.family, sentence=sentence, limit=limit, unit=each.unit)


def _gross(seen: Survey) -> Iterator[Exclusion]:
    """Return families with all alternatives excluded, for all or some joints."""
    for family in dict.fromkeys(each.alternative.family for each in seen.gross if each.alternative.family not in SIZED):
        words = GROSS.get(family, f"another {family}")
        own = [each for each in seen.gross if each.alternative.family == family]
        lost = [each for each in own if _loss(each) > SURELY_WORSE]
        still = {each.alternative.joints for each in own if _loss(each) <= SURELY_WORSE}
        joints = sorted({each.alternative.joints for each in own} - still)
        if joints and all(len(each) == 1 for each in joints):
            named = tuple(j for (j,) in joints)
            yield Exclusion(family=family, sentence=words.format(joints=_numbers(named)), joints=named)
        elif lost and "{joints}" not in words:
            many = "" if len(lost) == len(own) else f" ({len(lost)} of {len(own)} cases)"
            yield Exclusion(family=family, sentence=f"{words}{many}")


def indistinguishable(seen: Survey, sizes: Sizes, base: Stated | None = None) -> Iterator[str]:
    """Return faults of single joints, and factors of time and currents, that these logs cannot reveal.

    Args:
        seen: Comparison with all alternatives.
        sizes: Its `undetected_sizes`.
        base: The estimate, for the effect on the gains, or None.
    """
    n, open_ones = seen.logs.structure.arm.n, _of_every_log(seen)
    for j in range(n):
        own = [each for each in open_ones if each.joints == (j,)]
        kinds = [kind for kind in ("sign", "zero", "unit") if any(each.family == kind for each in own)]
        if kinds:
            half = kinds == ["zero"] and all(abs(each.value or 0.0) > QUARTER for each in own)
            yield f"zero of q{j + 1} off by half a turn" if half else f"{enumerated(kinds)} of q{j + 1}"
    yield from _open_factors(seen, sizes, base)


def indistinguishable_together(seen: Survey, sizes: Sizes) -> Iterator[str]:
    """Return faults of several joints together that these logs cannot reveal; arguments as for `indistinguishable`."""
    bounded = {each for each in SIZED if sizes.get((each, False, False))} | {"clock"}
    rest = [each for each in _of_every_log(seen) if len(each.joints) != 1 and each.family not in bounded]
    if rest:
        yield f"whether {_few([each.words for each in rest])}"


def _open_factors(seen: Survey, sizes: Sizes, base: Stated | None) -> Iterator[str]:
    """Return factors of time and of currents in one log that are not bounded, and the effect of 1 % on a gain."""
    for family, of_joints, one_log, words in OPEN:
        logs = 1 if one_log else len(seen.logs.recordings)
        own = [each for each in seen.directions if each.family == family and bool(each.joints) == of_joints]
        bounded = sizes[family, of_joints, one_log]
        own = [each for each in own if (each.joints, "%") not in bounded and len(each.logs) == logs]
        if own:
            moved = 0.0 if base is None else _moved_by_a_hundredth(own, base)
            matters = f" (1 % changes a gain by {moved:.2g} %)" if moved else ""
            yield f"{words.format(joints=_numbers(sorted({j for each in own for j in each.joints})))}{matters}"


def _moved_by_a_hundredth(scales: Sequence[Direction], base: Stated) -> float:
    """Largest change of a gain [%] by 1 % of any of the factors."""
    found = (effect for each in scales for effect in base.effects(0.01 * base.stacked(each.columns)[:, 0]))
    return max((abs(effect.percent) for effect in found), default=0.0)


def _of_every_log(seen: Survey) -> list[Alternative]:
    """Return alternatives for all logs that these do not distinguish from the logs as they are."""
    open_ones = (each.alternative for each in seen.gross if _loss(each) <= SURELY_WORSE)
    return [each for each in open_ones if each.logs == seen.logs.every]


def _loss(each: Screened) -> float:
    """Loss of log-likelihood by an alternative."""
    return -float(each.gain.sum())


def _few(words: Sequence[str]) -> str:
    more = f", or {len(words) - NAMED} more" if len(words) > NAMED else ""
    return ", or ".join(words[:NAMED]) + more


def _numbers(joints: Sequence[int]) -> str:
    """Joints, from 0, as `2 to 5` or `2, 4`."""
    numbers = sorted(j + 1 for j in joints)
    if len(numbers) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"{numbers[0]} to {numbers[-1]}"
    return ", ".join(str(each) for each in numbers)


def _rounded(x: float) -> float:
    """Round to two digits at most."""
    return float(f"{x:.2g}")
