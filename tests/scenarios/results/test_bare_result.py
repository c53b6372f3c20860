"""Results of bare motions: their links, and the names of friction."""

from types import SimpleNamespace

import numpy as np
import pytest

from ident.estimation.estimators.nls import FRICTION_TERMS
from ident.estimation.terms import SHARES
from scenarios.results.bare import TERMS, Link, LinkInertia, Links


@pytest.mark.parametrize(
    ("turns", "unit"), [((True, True), "kg m^2"), ((False, False), "kg"), ((True, False), "kg (m^2)")]
)
def test_the_motor_of_a_sliding_joint_has_a_mass(turns, unit):
    six = LinkInertia(**dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 0.02))
    given = {"mass": 2.5, "com": (0.1, 0.2, -0.3), "inertia": six, "motor_inertia": 0.7}
    units = ["kg m^2" if turn else "kg" for turn in turns]
    links = [Link.model_construct(joint=j, motor_unit=each, **given) for j, each in enumerate(units, 1)]
    for far, said in ((0.4, "by 0.4 standard deviations."), (4.5, "by 4.5 standard deviations. This is too large; ")):
        found = Links.model_construct(links=links, farthest_parameter="MX2", farthest_deviations=far)
        table, words = found.parts()
        assert {each.title: each.unit for each in table.columns}["Motor"] == unit
        assert f"MX2 differs most from its estimate, {said}" in words.text


def test_every_term_of_friction_has_its_meaning():
    known = {"Fv", "Fc", "off", *SHARES, *FRICTION_TERMS}
    assert set(TERMS) == known


def test_the_parameter_that_gave_way_most_may_have_become_smaller():
    own = np.array([[0.2, 0.01, 0.02, 0.3, 0.03, 0.25, 0.1, -0.2, 0.3, 2.5]])
    found = SimpleNamespace(
        own=own,
        motor=np.array([0.7]),
        motor_found=np.array([True]),
        names=("MX1", "MY1", "ZZ1"),
        moved=np.array([0.3, -4.5, 2.1]),
    )
    arm = SimpleNamespace(
        n=1,
        joint_names=("a",),
        revolute=np.array([True]),
        translation=np.zeros((1, 3)),
        rotation=np.eye(3)[None],
        axis=np.array([[0.0, 0.0, 1.0]]),
    )
    links = Links.of(found, SimpleNamespace(carried=np.zeros((1, 10))), arm)
    assert (links.farthest_parameter, links.farthest_deviations) == ("MY1", 4.5)
