"""Laws of drive gains, put into the currents of a three-axis arm."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from consistency_logs import PAYLOADS, changed, logs_of, problem_of, ready_of
from real_friction import GAIN, Truth
from scipy.integrate import quad

from ident.estimation import laws
from ident.estimation.all_joints import fit
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.laws import Coefficients, columns_of, expected_spread, torques_by_log, with_laws
from ident.recordings.recording import Recording

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


ALIKE = [pytest.param(each, marks=pytest.mark.slow) for each in LAWS if each not in ("scale", "position")]


@pytest.mark.parametrize("law", ["scale", "position", *ALIKE])
def test_a_law_that_the_currents_show_corrects_the_gains_and_is_named_with_its_size(axes, law):
    size, words, change = LAWS[law]
    logs = logs_of(Truth(), 5)
    bent = [changed(log, v=log.v * (1.0 + size * change(log, logs[1]))) for log in logs]
    constant, lawful = gains(axes, bent), gains(axes, bent, gain_laws=True)
    (said,) = [each for each in lawful.remarks if words in each]
    found, noise = (0.01 * float(each) for each in re.findall(r"([-+.\d]+) ± ([.\d]+) %", said)[0])
    assert abs(found - size) < 3.0 * noise + 0.2 * abs(size)
    assert np.abs(off(lawful)).max() < 3.0
    (told,) = [each for each in constant.remarks if said in each]
    change = lawful.gain / constant.gain - 1.0
    worst = int(np.argmax(np.abs(change * constant.gain) / constant.std))
    assert f"the gain of joint {worst + 1} changes by {100.0 * change[worst]:+.2g} %" in told
    assert np.abs(off(constant)).max() > 1.7 * np.abs(off(lawful)).max()


@pytest.mark.parametrize("seed", [5, *(pytest.param(each, marks=pytest.mark.slow) for each in (6, 7))])
def test_sound_logs_show_no_law(axes, seed):
    logs = logs_of(Truth(), seed)
    constant, lawful = gains(axes, logs, **EXACT), gains(axes, logs, gain_laws=True)
    assert lawful.remarks == constant.remarks
    np.testing.assert_array_equal(lawful.gain, constant.gain)


def test_currents_of_one_log_have_no_scale_of_their_own(axes, monkeypatch):
    problem = problem_of(axes, logs_of(Truth())[1:], PAYLOADS[1:])
    ready = ready_of(problem)
    before = fit(ready, {}, None)
    assert with_laws(ready, {}, before, {"scale": 0.01}).fit is before
    monkeypatch.setattr(laws, "SURE", -9.0)
    assert with_laws(ready, {}, before, {"scale": 0.01, "sign": 0.01}).scaled.shape[1] == 0


def test_columns_are_those_of_the_equation_and_without_laws_a_fit_is_what_it_was(axes):
    ready = ready_of(problem_of(axes, logs_of(Truth())))
    before = fit(ready, {}, None)
    assert with_laws(ready, {}, before, {}).fit is before
    rows, i = ready.columns, before.fitted_currents
    (size,), (sign,), turn, within = (
        [*columns_of(law, ready, before).values()] for law in ("size", "sign", "position", "time")
    )
    for j in range(3):
        own = rows.joint == j
        rms = np.sqrt(np.mean(i[own & rows.loaded] ** 2))
        np.testing.assert_allclose(size[own], i[own] * (np.abs(i[own]) - rms) / np.abs(i[own]).max(), rtol=1e-12)
    np.testing.assert_array_equal(sign, np.abs(i))
    assert (len(turn), len(within)) == (2, 2)
    for log, each in enumerate(within):
        own = rows.motion == log
        assert not each[~own].any()
        np.testing.assert_allclose(each[own] / i[own], rows.position[own] / rows.position[own].max() - 0.5, rtol=1e-12)
    whole = rows.weight > 0.999
    np.testing.assert_allclose(np.hypot(*turn)[whole], np.abs(i[whole]), rtol=0.02)
    torque = torques_by_log(ready, before)
    assert torque.shape == (len(i), 1)
    assert not torque[rows.motion == 0].any()
    late = rows.motion == 1
    friction = np.sum(before.model.F * before.phi[rows.joint], axis=1)
    np.testing.assert_allclose((torque[:, 0] * before.h[rows.joint] + friction)[late], i[late], rtol=1e-9)


def test_the_spread_of_drives_is_expected_from_their_coefficients_and_what_is_stated():
    value, noise, stated = np.array([0.013, -0.031, 0.022]), np.array([0.004, 0.011, 0.007]), 0.02

    def density(spread: float) -> float:
        v = noise**2 + spread**2
        return float(np.exp(-0.5 * (np.sum(np.log(v) + value**2 / v) + (spread / stated) ** 2)))

    squares, whole = (quad(lambda x, p=p: x**p * density(x), 0.0, 0.2, epsabs=0.0, limit=200)[0] for p in (2, 0))
    found = expected_spread(Coefficients(value, noise, (0, 1, 2), (0, 0, 0)), stated)
    np.testing.assert_allclose(found, np.sqrt(squares / whole), rtol=0.01)
    alone = expected_spread(Coefficients(value[:0], noise[:0], (), ()), stated)  # of nothing, what is stated
    np.testing.assert_allclose(alone, stated, rtol=0.01)
