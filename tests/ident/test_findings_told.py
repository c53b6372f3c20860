"""What is told of findings, and the limits they are held against."""

import numpy as np
from consistency_logs import LOOSE, PAYLOADS, PLAIN, logs_of, with_current
from ident.consistency import UNCHECKED
from ident.consistency.difference import FALSE_ALARM, FREEDOM, most_deviations
from ident.consistency.finding import joints_in_words
from ident.wiring import known_wiring
from real_friction import Truth

from ident.identification import Recorded, identify_motions


def test_limits_are_those_of_students_t_for_so_many_tests():
    from scipy import stats

    np.testing.assert_allclose(2 * 7 * stats.t.sf(most_deviations(7), FREEDOM), FALSE_ALARM, rtol=1e-9)


def test_joints_are_listed_in_words():
    assert joints_in_words([3]) == "joint 4"
    assert joints_in_words([0, 4]) == "joints 1 and 5"
    assert joints_in_words([0, 2, 4]) == "joints 1, 3 and 5"


def test_failed_tests_are_among_the_notes_of_an_identification(axes):
    logs = [with_current(log, 1, lambda v, t, q, dq: np.where(t > 0.5, 1.03 * v, v)) for log in logs_of(Truth())]
    motions = [Recorded(log, payload) for log, payload in zip(logs, PAYLOADS, strict=True)]
    given = {"options": PLAIN, "gains": LOOSE, "wiring": known_wiring}
    found = identify_motions(motions, axes, **given)
    failed = [each for each in found.findings if each.failed]
    assert any(each.check == "halves" for each in failed)
    assert all(each.sentence in found.notes for each in failed)
    quiet = identify_motions(motions, axes, **given, checks=UNCHECKED)
    assert quiet.findings == ()
    assert not any("second half" in note for note in quiet.notes)
