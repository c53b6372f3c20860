"""Laws of drive gains, put into the currents of a three-axis arm."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from consistency_logs import PAYLOADS, changed, logs_of, problem_of, ready_of
from pinocchio_arms import random_arm
from real_friction import GAIN, Truth
from scipy.integrate import quad

from ident.estimation import laws
from ident.estimation.all_joints import Fit, fit
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.known_gains import estimated_gains
from ident.estimation.laws import Coefficients, Place, coefficients, columns_of, expected_spread, with_laws
from ident.estimation.setting import Term
from ident.model.arm import arm_from_pinocchio
from ident.model.structure import structure_of
from ident.recordings.recording import Recording
from ident.support.errors import NotIdentifiable, OptionError

EXACT = {f"{law}_std": 0.0 for law in ("scale", "size", "sign", "position", "time")}


def gains(axes, logs, **options) -> GainEstimate:
    return all_joints_gains(problem_of(axes, logs), AllJointsOptions(zero_std=0.0, tilt_std=0.0, **options))


def off(estimate: GainEstimate) -> np.ndarray:
    """Errors of the gains in claimed deviations."""
    return np.array([(each.value - GAIN[j]) / each.std for j, each in enumerate(estimate.joints)])


def time(log: Recording) -> np.ndarray:
    return ((log.t - log.t[0]) / (log.t[-1] - log.t[0]) - 0.5)[:, None]


def beyond_rms(log: Recording, heavy: Recording) -> np.ndarray:
    rms, peak = np.sqrt(np.mean(heavy.v**2, axis=0)), np.abs(heavy.v).max(axis=0)
    return (np.abs(log.v) - rms) / peak


Law = Callable[[Recording, Recording], np.ndarray | float]
LAWS: dict[str, tuple[float, str, Law]] = {
    "scale": (0.03, "log 2 differ from those of the first log by", lambda log, heavy: float(log is heavy)),
    "size": (0.05, "falls with the size of the current, at its peak relative to zero by", beyond_rms),
    "sign": (-0.04, "positive currents per torque are larger by", lambda log, _: np.sign(log.v)),
    "position": (0.05, "once a turn, by", lambda log, _: np.cos(log.q - 0.3)),
    "time": (0.05, "within log 2, from beginning to end by", lambda log, _: time(log)),
}
"""Of each law its size here, what is said of it, and the relative change of the currents for size 1.

The rms current of the size is that of all samples here, of moving ones in the estimate, so that gains differ by .3 %.
"""


def bent(logs: list[Recording], law: str, share: float = 1.0) -> list[Recording]:
    size, _, change = LAWS[law]
    return [changed(log, v=log.v * (1.0 + share * size * change(log, logs[1]))) for log in logs]


ALIKE = [pytest.param(each, marks=pytest.mark.slow) for each in LAWS if each not in ("scale", "position")]


@pytest.mark.parametrize("law", ["scale", "position", *ALIKE])
def test_a_law_that_the_currents_show_corrects_the_gains_and_is_named_with_its_size(axes, law):
    size, words, _ = LAWS[law]
    logs = bent(logs_of(Truth(), 5), law)
    constant, lawful = gains(axes, logs), gains(axes, logs, gain_laws=True)
    (said,) = [each for each in lawful.remarks if words in each]
    found, noise = (0.01 * float(each) for each in re.findall(r"([-+.\d]+) ± ([.\d]+) %", said)[0])
    assert abs(found - size) < 3.0 * noise + 0.2 * abs(size)  # of several joints the largest is told, and shrunk ones
    assert np.abs(off(lawful)).max() < 3.0  # three gains: by chance once in 120 seeds
    (told,) = [each for each in constant.remarks if said in each]
    change = lawful.gain / constant.gain - 1.0
    exact = gains(axes, logs, **EXACT)
    worst = int(np.argmax(np.abs(change * exact.gain) / exact.std))
    assert f"the gain of joint {worst + 1} changes by {100.0 * change[worst]:+.2g} %" in told
    assert np.abs(off(exact)).max() > 1.7 * np.abs(off(lawful)).max()  # of time, least: 1.9


@pytest.mark.parametrize("law", ["scale", "position", *ALIKE])
def test_a_law_counts_in_the_intervals_of_gains_that_it_does_not_correct(axes, law):
    logs = bent(logs_of(Truth(), 6), law, 0.5)
    constant, exact = gains(axes, logs), gains(axes, logs, **EXACT)
    np.testing.assert_array_equal(constant.gain, exact.gain)
    assert np.abs(off(constant)).max() < 2.6  # three gains: by chance once in 36 seeds
    assert (constant.std > exact.std).all()


def test_neglected_coefficients_have_the_mean_square_of_a_fit_with_them(axes, monkeypatch):
    monkeypatch.setattr(laws, "SURE", np.inf)  # nothing is shown
    ready = ready_of(problem_of(axes, bent(logs_of(Truth()), "scale", 0.1)))
    before = fit(ready, {}, None)
    stated = {"scale": 0.013, "sign": 0.009}
    spread: dict[str, float] = {}
    monkeypatch.setattr(laws, "expected_spread", lambda found, std: spread.setdefault(found.places[0].law, std))
    monkeypatch.setattr(laws, "WIDE", 200.0)
    unsure = with_laws({}, before, stated, corrected=False).unsure
    assert spread == stated
    columns = {law: columns_of(law, before) for law in stated}
    joint = ready.columns.joint
    torque = columns["scale"][1] / before.h[joint]
    wide = ready.widened(torque[:, None], stated["scale"])
    found = coefficients(fit(wide, {"sign 0": Term(columns["sign"][0], std=stated["sign"])}, before), columns)
    assert [each.law for each in found.places] == ["scale", "sign", "sign", "sign"]
    assert [each.joint for each in found.places] == [-1, 0, 1, 2]
    square = found.covariance + np.outer(found.value, found.value)
    moved = [before.log_h.influence @ columns["scale"][1]]
    moved += [before.log_h.influence[:, joint == j] @ columns["sign"][0][joint == j] for j in range(3)]
    S = np.column_stack(moved)
    # The jackknife of a fit with narrow priors is not that of one with wide ones.
    np.testing.assert_allclose(unsure @ unsure.T, S @ square @ S.T, rtol=0.15)


@pytest.mark.parametrize("seed", [5, *(pytest.param(each, marks=pytest.mark.slow) for each in (6, 7))])
def test_sound_logs_show_no_law(axes, seed):
    logs = logs_of(Truth(), seed)
    constant, lawful = gains(axes, logs, **EXACT), gains(axes, logs, gain_laws=True)
    assert lawful.remarks == constant.remarks
    np.testing.assert_array_equal(lawful.gain, constant.gain)


def test_currents_of_one_log_have_no_scale_of_their_own_and_prismatic_joints_no_ripple_once_a_turn(axes, monkeypatch):
    sliding = structure_of(arm_from_pinocchio(random_arm(np.random.default_rng(3), 2, prismatic=1.0)))
    two = [changed(log, q=log.q[:, :2], v=log.v[:, :2]) for log in logs_of(Truth())]
    one = problem_of(axes, logs_of(Truth())[1:], PAYLOADS[1:])
    for law, problem in (("position", problem_of(sliding, two)), ("scale", one)):
        before = fit(ready_of(problem), {}, None)
        assert columns_of(law, before) == {}
        assert with_laws({}, before, {law: 0.01}, corrected=True).fit is before
    monkeypatch.setattr(laws, "SURE", -9.0)
    assert with_laws({}, before, {"scale": 0.01, "sign": 0.01}, corrected=True).scaled.shape[1] == 0


def test_gains_without_laws_remain_where_a_fit_with_them_fails(axes, monkeypatch):
    ready = ready_of(problem_of(axes, logs_of(Truth())))
    before = fit(ready, {}, None)

    def few_rows(*_):
        raise NotIdentifiable("too few rows")

    monkeypatch.setattr(laws, "fit", few_rows)
    left = with_laws({}, before, {"sign": 0.01}, corrected=True)
    assert left.fit is before
    assert left.unsure.shape == (3, 0)


def test_laws_are_not_asked_of_a_stated_friction():
    with pytest.raises(OptionError, match="gain_laws = true: expected friction = 'auto', not 'cbrt'"):
        AllJointsOptions(gain_laws=True, friction="cbrt")


def test_columns_are_those_of_the_equation_and_without_laws_a_fit_is_what_it_was(axes):
    ready = ready_of(problem_of(axes, logs_of(Truth())))
    before = fit(ready, {}, None)
    assert with_laws({}, before, {}, corrected=True).fit is before
    rows, i = ready.columns, before.fitted_currents
    (scale,), (size,), (sign,), turn, within = (columns_of(law, before).values() for law in LAWS)
    for j in range(3):
        own = rows.joint == j
        rms = np.sqrt(np.mean(i[own & rows.loaded] ** 2))
        np.testing.assert_allclose(size[own], i[own] * (np.abs(i[own]) - rms) / np.abs(i[own]).max(), rtol=1e-12)
    np.testing.assert_array_equal(sign, np.abs(i))
    turn, within = [*turn], [*within]
    assert (len(turn), len(within)) == (2, 2)
    for log, each in enumerate(within):
        own = rows.motion == log
        assert not each[~own].any()
        np.testing.assert_allclose(each[own] / i[own], rows.position[own] / rows.position[own].max() - 0.5, rtol=1e-12)
    whole = rows.weight > 0.999
    np.testing.assert_allclose(np.hypot(*turn)[whole], np.abs(i[whole]), rtol=0.02)  # the filter averages turns
    assert not scale[rows.motion == 0].any()
    late = rows.motion == 1
    friction = np.sum(before.model.F * before.phi[rows.joint], axis=1)
    np.testing.assert_allclose((scale + friction)[late], i[late], rtol=1e-9)


def test_the_spread_of_drives_is_expected_from_their_coefficients_and_what_is_stated():
    value, noise, stated = np.array([0.013, -0.031, 0.022]), np.array([0.004, 0.011, 0.007]), 0.02

    def density(spread: float, k: int) -> float:
        v = noise[:k] ** 2 + spread**2
        return float(np.exp(-0.5 * np.sum(np.log(v) + value[:k] ** 2 / v)) / (1.0 + (spread / stated) ** 2) ** 2)

    end = 10.0 * stated * 1000.0 ** (0.5 / 60.0)  # half of one of 60 steps beyond the last spread
    for k in (3, 0):  # of three drives, and of what is stated alone
        squares, whole = (quad(lambda x, p=p, k=k: x**p * density(x, k), 0.0, end, limit=200)[0] for p in (2, 0))
        places = tuple(Place("size", 0, j) for j in range(k))
        found = expected_spread(Coefficients(places, value[:k], np.diag(noise[:k] ** 2)), stated)
        np.testing.assert_allclose(found, np.sqrt(squares / whole), rtol=0.01)  # steps of 12 %


def test_a_curve_has_the_coefficients_of_its_laws_and_the_gain_at_any_other_reference(axes, monkeypatch):
    logs = bent(bent(logs_of(Truth(), 5), "size"), "sign", 0.6)
    fits, sizes, kept = list[Fit](), laws._sizes, laws._curves
    monkeypatch.setattr(laws, "_curves", lambda found, before: fits.extend((found, before)) or kept(found, before))
    monkeypatch.setattr(laws, "SURE", -np.inf)  # both are shown
    both = {**dict.fromkeys(EXACT, 0.0), "size_std": 3.0, "sign_std": 2.0, "gain_laws": True}
    estimate = gains(axes, logs, **both)
    assert sum(each.startswith("joint") for each in estimate.remarks) == 3
    found, before = fits
    columns = {law: columns_of(law, before) for law in ("size", "sign")}
    same, peak = coefficients(found, columns), sizes(before)[1]
    known = estimated_gains(estimate)
    monkeypatch.setattr(laws, "_sizes", lambda before: (1.3 * sizes(before)[0], sizes(before)[1]))
    there = estimated_gains(gains(axes, logs, **both))
    for j, curve in known.curves.items():
        size, sign = (same.places.index(Place(law, 0, j)) for law in ("size", "sign"))
        scale, C = np.array((1.0 / peak[j], 1.0)), same.covariance[np.ix_((size, sign), (size, sign))]
        np.testing.assert_allclose((curve.slope, curve.by_sign), same.value[[size, sign]] * scale, rtol=1e-12)
        np.testing.assert_allclose(np.array(curve.covariance)[:, 1:], C * np.outer(scale, scale), rtol=1e-9)
        assert curve.largest == max(np.abs(log.v[:, j]).max() for log in logs)
        at = np.array(there.curves[j].current)
        np.testing.assert_allclose(there.value[j], known.value[j] * curve.even.relative(at), rtol=1e-3)
        # To first order, with a payload's share that is the same, and the larger of two estimates of each covariance.
        more = curve.even.rel_variance(at) / known.log_covariance[j, j]
        np.testing.assert_allclose(there.log_covariance[j, j] / known.log_covariance[j, j], 1.0 + more, atol=0.12)
