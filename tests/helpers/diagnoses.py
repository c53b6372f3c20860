"""Diagnoses by their name."""

from collections.abc import Sequence

from ident.diagnosis.diagnosis import Diagnosis


def named(diagnoses: Sequence[Diagnosis], name: str) -> Diagnosis:
    (found,) = [each for each in diagnoses if each.name == name]
    return found
