"""What logs say of each other: whether one of them alone counts currents or positions otherwise, and what is mounted.

The same questions as an identification asks before it believes any gain.
"""

from collections.abc import Callable, Sequence

from ident.checks.comparison import Alternative, Comparison, Logs
from ident.checks.remark import Grade, Remark
from ident.errors import Contradiction, NotConverged, NotIdentifiable
from ident.estimators import DEFAULT, ESTIMATORS
from ident.evidence import among_best, convincing, evidence_of, gain_over
from ident.identification import check_alone, joint_by_joint
from ident.one_log import Counting, check_scales, check_units, countings, scale_notes
from ident.one_log_readings import agree, one_log_explanations
from ident.plausibility import check_different, check_load
from ident.problem import Problem
from ident.rates import rate_notes
from ident.recording import Recording

TOPIC = "one log beside another"
MOUNTED = "bare and loaded"
NAMED = 3
"""Readings that a line names."""


def between_remarks(problem: Problem, logs: Logs, comparison: Comparison) -> list[Remark]:
    """What is wrong in one log alone; nothing where nothing is.

    Args:
        problem: The motions of the logs.
        logs: The same, prepared to be read in several ways.
        comparison: What readings of all of them explain.
    """
    if len(logs.recordings) < 2:
        return []
    counted = countings(problem, [each.name for each in logs.recordings])
    wrong = (
        _told(TOPIC, lambda: check_units(counted))
        or _one_log(logs, comparison)
        or _told(TOPIC, lambda: check_scales(counted))
    )
    return wrong or [*_rates(logs.recordings), *_doubts(counted)]


def mounted_remarks(problem: Problem, recordings: Sequence[Recording]) -> list[Remark]:
    """What an identification would refuse of bare and loaded motions before it looks at a gain."""
    twice = _told(MOUNTED, lambda: check_different(recordings))
    if twice:
        return twice
    alone = joint_by_joint(problem)
    if alone is None:
        return []
    wrong = _told(MOUNTED, lambda: check_alone(problem, alone))
    return wrong if wrong or alone.identifiable.any() else _told(MOUNTED, lambda: _check_default(problem))


def _check_default(problem: Problem) -> None:
    """Refuse motions from which the method that is used where none is named finds no load.

    Asked only where no joint alone has a gain: it takes longer, and sees whatever they see.
    """
    chosen = ESTIMATORS[DEFAULT]
    check_load(chosen.estimate(problem, chosen.options()))


def _told(topic: str, asked: Callable[[], None]) -> list[Remark]:
    """What a check refuses, as a remark."""
    try:
        asked()
    except (Contradiction, NotConverged, NotIdentifiable) as error:
        return [Remark(topic=topic, seen=str(error), grade=Grade.WRONG, advice="an identification refuses these logs")]
    return []


def _rates(recordings: Sequence[Recording]) -> list[Remark]:
    return [
        Remark(topic=TOPIC, seen=note, grade=Grade.WEAK, advice="look at how t was made in both logs")
        for note in rate_notes(recordings)
    ]


def _doubts(counted: Sequence[Counting]) -> list[Remark]:
    return [
        Remark(topic=TOPIC, seen=note, grade=Grade.WEAK, advice="look at the units of both logs")
        for note in scale_notes(counted)
    ]


def _one_log(logs: Logs, comparison: Comparison) -> list[Remark]:
    """Readings of one log alone that surely explain more; none if one of all logs does as well, or lets them agree."""
    given = comparison.given
    ordinary = [each for each in comparison.alternatives if _ordinary(each)]
    if ordinary:
        reading = max(ordinary, key=lambda each: float(each.gain.sum())).readings[0]
        if agree(logs.arm, logs.unknowns_under(reading), logs.seen, reading):
            return []
    found = one_log_explanations(logs.arm, logs.unknowns, logs.seen, logs.recordings, given)
    gains = [gain_over(given.left, each.left) for each in found]
    best_of_all = max((float(each.gain.sum()) for each in comparison.alternatives), default=0.0)
    sure = [
        (each, gain)
        for each, gain in zip(found, gains, strict=True)
        if convincing(gain, evidence_of(gain, given.freedom, each.freedom), each.reading) and gain.sum() > best_of_all
    ]
    if not sure:
        return []
    best = [each for each, tied in zip(sure, among_best([gain for _, gain in sure]), strict=True) if tied]
    words = " or ".join(each.reading.words for each, _ in best[:NAMED])
    explained, gain = best[0]
    joint = int(gain.argmax())
    return [
        Remark(
            topic=TOPIC,
            joint=joint,
            seen=f"{words} explains the currents better: unexplained of joint {joint + 1} "
            f"{100.0 * explained.left[joint]:.2g} instead of {100.0 * given.left[joint]:.2g} %",
            grade=Grade.WRONG,
            advice="mend that log",
        )
    ]


def _ordinary(each: Alternative) -> bool:
    """Whether a reading of all logs, of the lengths as drawn, is surely better than the logs as they are."""
    return each.sure and bool((each.readings[0].stretch == 1.0).all())
