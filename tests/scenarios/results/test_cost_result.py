"""Results with a-priori and with identified gains: which is which, and two deviations in tables."""

from types import SimpleNamespace

import numpy as np
from page_parts import identified

from ident.estimation.estimate import RefusedGain
from ident.payload.payload import Payload
from scenarios.results.cost import ResultCost

NAMES = ("mass", "x", "y", "z", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def outcome(mass: float, std: float, *alone: tuple[float, float], gains: tuple[float, ...]) -> SimpleNamespace:
    """An outcome of two joints, with only the mass identifiable."""
    found = SimpleNamespace(value=mass, std=std)
    weighed = SimpleNamespace(
        payload=Payload(mass=5.0, mass_std=0.01, known="mass"),
        body=SimpleNamespace(of=lambda name: found if name == "mass" else None),
        joints=[SimpleNamespace(mass=SimpleNamespace(value=value, std=each)) for value, each in alone],
    )
    known = SimpleNamespace(joints=np.arange(len(gains)), value=np.array(gains))
    return SimpleNamespace(weighed=weighed, gains=known)


def test_estimates_with_either_gains_keep_their_own_deviations():
    joints = (identified(0.8, 0.02), RefusedGain(joint="b", reason="light", predicted_rel_std=None))
    verdict = SimpleNamespace(
        a_priori=outcome(5.6, 0.12, (5.9, 0.2), (4.1, 0.3), gains=(1.0, 1.1)),
        found=outcome(5.02, 0.03, (5.1, 0.07), (4.9, 0.09), gains=(0.8,)),
        torque_a_priori={0: 0.21}, torque_found={0: 0.013}, true=dict.fromkeys(NAMES, 4.97), arm=(), tolerance=0.02,
        passed=True,
    )  # fmt: skip
    cost = ResultCost.of_verdict(verdict, joints)
    mass = cost.payload[0]
    assert (mass.a_priori, mass.a_priori_std, mass.found, mass.found_std) == (5.6, 0.12, 5.02, 0.03)
    assert (mass.true, mass.stated) == (4.97, 5.0)
    first, second = cost.joints
    np.testing.assert_allclose(first.rel_difference, 1.0 / 0.8 - 1.0, rtol=1e-12)
    assert (second.gain, second.rel_difference) == (None, None)
    assert (first.a_priori_torque_error, first.found_torque_error) == (0.21, 0.013)
    said, weights, alone, _ = cost.parts("N m/unit")
    # The joint whose mass is off by most beyond two deviations: 4.97 - 4.1 - 0.6 and 5.9 - 4.97 - 0.4.
    assert said.text == (
        "PASSED: the payload of 4.97 kg: with the a-priori gains 5.600 kg (+13 %) from all joints, 5.900 kg (+19 %) "
        "from joint 1 alone; with identified gains 5.020 kg (+1 %), tolerance 2 %."
    )
    assert [cell.text for cell in weights.rows[0]] == ["payload: mass", "5.60", "0.24", "5.020", "0.060", "4.970", "kg"]
    assert [cell.text for cell in alone.rows[0]] == [
        "1", "1.0000", "0.8000", "+25.0", "5.900", "0.400", "5.100", "0.140", "21.0", "1.3"
    ]  # fmt: skip
