"""Shared by tests of consistency: an arm, and estimates without a fault."""

import pytest
from consistency_logs import evidence_of, logs_of, problem_of
from known_logs import arm_of
from real_friction import Truth, three_axes

from ident.consistency.evidence import Evidence
from ident.estimators.nls import AllJointsOptions
from ident.structure import Structure, structure_of


@pytest.fixture(scope="session")
def axes() -> Structure:
    return structure_of(arm_of(three_axes()))


@pytest.fixture(scope="session")
def clean(axes) -> Evidence:
    return evidence_of(problem_of(axes, logs_of(Truth())))


@pytest.fixture(scope="session")
def chosen(axes) -> Evidence:
    return evidence_of(problem_of(axes, logs_of(Truth())), AllJointsOptions())
