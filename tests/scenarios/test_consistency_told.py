"""How failed consistency tests are told: warnings before notes, and every test for programs."""

from dataclasses import replace

import numpy as np
from estimates import gain_estimate
from ident.consistency.finding import Finding

from ident.identification import Identification
from scenarios.reports.content import Mood
from scenarios.reports.gains import note_paragraphs
from scenarios.store.documents import estimate_document

FAILED = Finding(
    check="halves", joint=2, statistic=5.5, threshold=3.7, measure="standard deviations", sentence="joint 3 drifts"
)
PASSED = replace(FAILED, check="joints", joint=0, statistic=1.2, sentence=None)


def test_a_failed_test_is_a_warning_before_the_notes_and_not_a_note_as_well():
    meaning, warning, *notes = note_paragraphs(("clock jitters", "joint 3 drifts"), (PASSED, FAILED), np.ones(6))
    assert meaning.text.startswith("Gains in N m")
    assert warning.text == "Warning: joint 3 drifts."
    assert warning.mood is Mood.DOUBTFUL
    assert warning.strong
    assert [note.text for note in notes] == ["Note: clock jitters."]


def test_programs_are_given_every_test_with_joints_from_1():
    found = Identification(gain_estimate(3.3, 4.4, 5.5, std=0.1, reason=""), ("joint 3 drifts",), (PASSED, FAILED))
    passed, failed = estimate_document(found, 0.1)["consistency"]
    assert passed == {
        "check": "joints",
        "joint": 1,
        "statistic": 1.2,
        "threshold": 3.7,
        "measure": "standard deviations",
        "change": None,
        "sentence": None,
        "failed": False,
    }
    assert failed["joint"] == 3
    assert failed["failed"]
    assert failed["sentence"] == "joint 3 drifts"
