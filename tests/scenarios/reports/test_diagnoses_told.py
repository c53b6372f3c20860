"""How what is said of logs and of an estimate is told: warnings before notes, and everything for programs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from estimates import gain_estimate
from scenarios.reports.identify import kept_paragraphs, summary

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Exclusion, Severity
from ident.identification import Identification
from scenarios.rendering.content import Mood
from scenarios.rendering.result import to_json
from scenarios.results.diagnoses import doubt_paragraphs, horizon_paragraphs, words_of
from scenarios.results.gains import Result, note_paragraphs
from scenarios.results.record import RESULT, read_result

DOUBT = Diagnosis(
    name="zero",
    severity=Severity.WEAK,
    sentence="the zero of q3 is off by 2 degrees",
    advice="correct it",
    joints=(2,),
    logs=("far/b.csv",),
    value=2.0,
    std=0.1,
    unit="degrees",
    z=5.5,
    effects=(Effect(joint=2, percent=-1.5, deviations=-2.0), Effect(joint=1, percent=0.1, deviations=0.1)),
)
GOOD = Diagnosis(name="clipping", sentence="no current is clipped", logs=("far/a.csv",))
FOUND = Diagnosed(
    diagnoses=(DOUBT, GOOD),
    excluded=(
        Exclusion(family="delay", sentence="delays beyond 5 ms", limit=5.0, unit="ms"),
        Exclusion(family="sign", sentence="another sign (7 of 12 cases)"),
    ),
    indistinguishable=("zero of q1",),
    indistinguishable_together=("whether q4 is negated",),
)


def test_a_warning_stands_before_the_notes_and_what_the_logs_exclude_is_said_apart():
    meaning, warning, *rest = note_paragraphs(("clock jitters",), FOUND, np.ones(6))
    assert meaning.text.startswith("Gains in N m")
    assert warning.text == "WARNING b.csv: the zero of q3 is off by 2 degrees. Correct it."
    assert (warning.mood, warning.strong) == (Mood.DOUBTFUL, True)
    assert [each.text for each in rest] == ["Note: clock jitters."]
    assert [each.text for each in horizon_paragraphs(FOUND)] == [
        "Excluded: delays beyond 5 ms.",
        "Cannot be checked with these logs: zero of q1.",
    ]


def test_a_fault_is_marked_as_worse_than_a_warning():
    (wrong,) = doubt_paragraphs(Diagnosed(diagnoses=(replace(DOUBT, severity=Severity.WRONG),)))
    assert wrong.text.startswith("WRONG: ")
    assert wrong.mood is Mood.BAD


def test_a_log_is_named_once_and_a_rival_stands_in_place_of_the_advice():
    named = replace(DOUBT, sentence="the zero of q3 is off in b.csv alone")
    assert words_of(named, several=True) == "WARNING: the zero of q3 is off in b.csv alone. Correct it."
    tied = replace(DOUBT, rivals=("the base is tilted", "a delay"))
    assert words_of(tied, several=False) == (
        "WARNING: the zero of q3 is off by 2 degrees. "
        "These logs do not distinguish it from: the base is tilted and 1 more."
    )


def test_gains_that_are_kept_beside_a_fault_are_told_with_what_it_does_to_them():
    effects = ((0, -9.3, -7.0), (1, 0.62, 2.1), (2, 0.1, 0.3))
    wrong = replace(
        DOUBT, severity=Severity.WRONG, effects=tuple(Effect(joint=j, percent=p, deviations=d) for j, p, d in effects)
    )

    def result(said: Diagnosed) -> Result:
        found = gain_estimate(None, 4.4, 5.5, std=0.1, reason="")
        return Result.of_identification(Identification(found, (), said), 0.1)

    smaller = replace(wrong, effects=(Effect(joint=1, percent=-0.41, deviations=-1.4),))
    told_wrong = result(Diagnosed(diagnoses=(smaller, wrong)))  # joint 2 once, with the larger effect
    (told,) = kept_paragraphs(told_wrong)
    assert told.text == (
        "Gains kept although a fault changes them, by less than 3 standard deviations: joint 2 by +0.62 %."
    )
    assert kept_paragraphs(result(FOUND)) == []
    said = summary(told_wrong)
    assert said.text == (
        "2 of 3 gains identified from 6 rows, relative residual 5.00 %; joint 1 refused because of a fault of the logs."
    )
    assert said.mood is Mood.BAD
    assert summary(result(FOUND)).text.endswith("relative residual 5.00 %.")


def test_what_was_asked_is_told_though_it_is_good():
    asked = replace(GOOD, name="delay", sentence="no delay is found", asked=True)
    (told,) = doubt_paragraphs(Diagnosed(diagnoses=(asked, GOOD)))
    assert told.text == "Note: no delay is found."
    assert not told.strong


def test_programs_are_given_every_diagnosis_with_joints_from_1(tmp_path):
    found = Identification(gain_estimate(3.3, 4.4, 5.5, std=0.1, reason=""), ("clock jitters",), FOUND)
    document = Result.of_identification(found, 0.1).model_dump(mode="json")
    assert document["notes"] == ["clock jitters"]
    assert [each["joints"] for each in document["diagnoses"]] == [[3], []]
    assert [each["joint"] for each in document["diagnoses"][0]["effects"]] == [3, 2]


def test_what_was_said_is_read_back_as_it_was(tmp_path: Path):
    found = Identification(gain_estimate(3.3, 4.4, 5.5, std=0.1, reason=""), ("clock jitters",), FOUND)
    result = Result.of_identification(found, 0.1)
    (tmp_path / RESULT).write_text(to_json(result.model_dump(mode="json")))
    again = read_result(tmp_path, Result)
    assert again == result
    both = (*FOUND.indistinguishable, *FOUND.indistinguishable_together)
    assert again.found == replace(FOUND, indistinguishable=both, indistinguishable_together=())
