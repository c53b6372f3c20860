"""What a payload, or the links as drawn, say of gains on a motion from exact states."""

from dataclasses import replace

import numpy as np
import pytest
from exact import GAIN, TRUSTING, exact_problem
from unseen_motions import FIT, LOG, loaded_motion, model

from ident.unseen import UnseenMotion, UsedModel, predicted


@pytest.fixture
def motion(structure, heavy, rng) -> tuple[UnseenMotion, np.ndarray]:
    return loaded_motion(structure, heavy, rng)


def weighed(structure, unseen: UnseenMotion, base: np.ndarray, factor: float) -> list[tuple[float, float]]:
    """Gain errors, and their deviations, of gains a factor too large and the arm that bare motions show with them."""
    fits = {j: replace(FIT[2], joint=j, share=0.05) for j in (0, 1, 2, 3, 4)}
    found = predicted(unseen, replace(model(structure, factor * base, factor * GAIN), fits=fits))
    assert (found.joints[5].gain_rel_error, found.joints[5].gain_rel_std) == (
        None,
        None,
    )  # nobody fitted an arm to joint 6
    return [(each.gain_rel_error, each.gain_rel_std) for each in found.joints[:5]]


def test_the_payload_says_by_how_much_gains_are_too_large_whatever_arm_they_gave(structure, motion, heavy):
    unseen, base = motion
    for factor, stated in ((1.0, 1.0), (1.37, 1.0), (0.8, 1.0), (1.0, 1.6)):
        carried = replace(heavy, mass=stated * heavy.mass, inertia=tuple(stated * x for x in heavy.inertia))
        other = replace(unseen, log=replace(unseen.log, payload=carried))
        for error, std in weighed(structure, other, base, factor):
            # Noise of 0.1 % of the current: the deviation says what it makes of the payload's share of the torque.
            assert abs(error - (factor / stated - 1.0)) < 4.0 * std
            assert std < 0.05


def test_more_friction_than_the_arm_has_is_not_taken_for_the_payload(structure, motion):
    unseen, base = motion
    names = structure.base.names
    braked = base * np.where([name[:2] in ("Fv", "Fc") or name.startswith("off") for name in names], 0.3, 1.0)
    assert [each[0] for each in weighed(structure, unseen, braked, 1.2)] == pytest.approx(
        [each[0] for each in weighed(structure, unseen, base, 1.2)], abs=1e-9
    )


def test_inertia_of_rotors_is_the_arm_s_and_no_free_friction(structure, motion):
    unseen, base = motion
    rotor = np.array([name.startswith("Ia") for name in structure.base.names])
    j = int(structure.base.names[np.flatnonzero(rotor)[0]].removeprefix("Ia")) - 1
    before, after = (weighed(structure, unseen, each, 1.2)[j][0] for each in (base, base + 0.9 * rotor))
    assert abs(after - before) > 1e-3  # a free rotor would leave the payload's torque as it is


def test_deviations_of_arm_payload_and_gain_are_those_of_what_the_payload_says(structure, motion, heavy):
    unseen, base = motion
    used = replace(model(structure, base, GAIN), fits=FIT)
    surest = replace(heavy, mass_std=0.0, com_std=(0.0,) * 3, inertia_std=(0.0,) * 6)

    def std(used: UsedModel, payload=surest) -> float:
        return predicted(replace(unseen, log=replace(unseen.log, payload=payload)), used).joints[2].gain_rel_std

    least = std(used)
    part = unseen.parts[0].observation.joints[2]
    X = np.column_stack((part.W_L @ heavy.known_part().chi, part.W[:, -3:]))  # and friction and offset
    white = 1e-3 * np.sqrt(np.mean(part.V**2)) * abs(GAIN[2]) * np.linalg.norm(np.linalg.pinv(X)[0])
    # Of five blocks the deviation scatters by a third: three times as much or as little is once in a thousand seeds.
    assert white / 3.0 < least < 3.0 * white
    gains = replace(used.gains, covariance=np.diag((0.05 * GAIN) ** 2))
    assert std(replace(used, gains=gains)) == pytest.approx(np.hypot(least, 0.05), rel=1e-9)
    # A mass that is off by a share moves all that the payload says by as much; its centre stays where it is.
    off = std(used, replace(surest, mass_std=0.07 * heavy.mass))
    assert off > 0.05
    column = unseen.parts[0].observation.joints[2].columns[4]
    covariance = np.zeros((len(base),) * 2)
    covariance[column, column] = 0.4**2
    moved = replace(used, base=base + 0.4 * (np.arange(len(base)) == column))
    before, after = (predicted(unseen, each).joints[2].gain_rel_error for each in (used, moved))
    of_arm = np.hypot(least, after - before)
    assert std(replace(used, covariance=covariance)) == pytest.approx(of_arm, rel=1e-6)
    assert of_arm > 1.2 * least


def test_a_bare_motion_says_nothing_of_gains_by_a_payload(structure, rng):
    chi = rng.uniform(0.5, 2.0, 84)
    problem = exact_problem(structure, [(chi, None, None)], GAIN, rng, options=TRUSTING, noise=1e-3)
    unseen = UnseenMotion(log=LOG, parts=problem.motions)
    fits = {j: replace(FIT[2], joint=j) for j in range(6)}
    fitted = replace(model(structure, structure.base.regrouping @ chi, GAIN), fits=fits)
    assert [each.gain_rel_error for each in predicted(unseen, fitted).joints] == [None] * 6
