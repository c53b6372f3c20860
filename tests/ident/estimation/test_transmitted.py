"""Torques that currents show and what compliance does along them, beside inverse dynamics by Pinocchio."""

from dataclasses import replace

import numpy as np
import pytest
from known_logs import BRICK, fourier
from real_friction import GAIN, MIDDLE, RATE, Truth, real_logs, three_axes, torque, with_payload
from scipy.interpolate import make_interp_spline

from ident.estimation.all_joints.friction import OwnColumns
from ident.estimation.all_joints.solution import Fitted, Setting, fit_with, setting
from ident.estimation.all_joints.terms import of_rows, torque_terms
from ident.estimation.all_joints.torques import torques
from ident.estimation.all_joints.transmitted import by_currents, transmitted, without_friction
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.gain_options import GainOptions
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions, observe
from ident.recordings.recording import Recording

N = 3
PAYLOADS = (None, BRICK)
SWING = 2.0 * np.pi * np.array([3.1, 4.3, 6.5])
"""Of each link [rad/s]."""
SOFT = np.array([1e-4, 1e-4, 1e-4])
"""Compliance of each transmission [rad/(N m)]."""


def problem_of(axes: Structure, logs: list[Recording], **observing: float) -> Problem:
    motions = (
        ObservedMotion(observe(log, axes, ObserveOptions(**observing)), payload)
        for log, payload in zip(logs, PAYLOADS, strict=True)
    )
    return Problem(axes, tuple(motions), GainOptions(max_rel_std=10.0))


def fitted_to(problem: Problem) -> tuple[Setting, Fitted]:
    ready = setting(problem, per_motion=True, prior_std=1.0)
    return ready, fit_with(ready, [{}] * N, (), None)


@pytest.mark.parametrize("wired", [1.0, -1.0])
@pytest.mark.parametrize("form", ["", "load", "load-through", "load-motor"])
def test_friction_that_is_taken_off_a_current_leaves_that_of_the_links(form, wired):
    rng = np.random.default_rng(1)
    x, dq = 5.0 * rng.standard_normal(400), rng.standard_normal(400)
    value = {"Fv": 0.4, "Fc": 0.3, "off": -0.2, "cbrt": 0.25, "by-direction": 0.15} | ({form: 0.1} if form else {})
    value |= {"offset-share": 0.65} if form == "load-motor" else {}
    names = (*value, "Fv", "Fc")
    phi = np.array([*value.values(), 7.0, 9.0])
    motion = (1, 1, *(-1 for _ in range(len(value) - 2)), 0, 0)  # the last two are another motion's
    own = OwnColumns(names=names, motion=motion, F=np.zeros((0, len(phi))), mean=0.0 * phi, std=np.inf + phi)
    turns = wired * np.sign(dq)
    brakes = 0.4 * dq + 0.3 * np.sign(dq) - 0.2 + 0.25 * np.cbrt(dq) + 0.15 * np.abs(dq)
    carried = x + brakes
    V = carried + 0.1 * turns * {"load": np.abs(x), "load-through": np.abs(carried)}.get(form, 0.0)
    for _ in range(60 if form == "load-motor" else 0):
        V = carried + 0.1 * (0.35 * np.abs(V) + 0.65 * np.abs(V + 0.2)) * turns  # 0.65 of the offset is no torque
    np.testing.assert_allclose(without_friction(V, dq, own, phi, 1, wired=wired), x, rtol=0, atol=1e-12)


@pytest.mark.parametrize("late", [0.0, 0.016])
def test_torques_that_currents_show_are_those_of_links_and_payload(axes, late):
    # The same currents, stamped two samples early, with a delay that says so.
    logs = real_logs(Truth(), PAYLOADS, np.random.default_rng(5), noise=0.0)
    stamped = [replace(log, v=np.roll(log.v, -round(late * RATE), axis=0)) for log in logs]
    problem = problem_of(axes, stamped, current_delay=late)
    _, plain = fitted_to(problem)
    np.testing.assert_allclose(1.0 / plain.fit.found.h, GAIN, rtol=3e-3)
    for number, motion in enumerate(problem.motions):
        behind = motion.observation.full_rate
        assert behind is not None
        expected = torque(with_payload(three_axes(), PAYLOADS[number]), behind.q, behind.dq, behind.ddq)
        found = transmitted(motion, number, plain)
        # Beyond two periods of the low-pass from its reversals a joint's friction is known.
        turned = np.sign(behind.dq[1:]) != np.sign(behind.dq[:-1])
        for j in range(N):
            at = np.flatnonzero(turned[:, j])[:, None]
            far = (np.abs(np.arange(len(found)) - at) > 2.0 * RATE / 15.0).all(axis=0)
            assert far.mean() > 0.5
            far[[*range(10), *range(-10, 0)]] = False  # the ends of a low-passed signal
            np.testing.assert_allclose(
                found[far, j], expected[far, j], rtol=0, atol=1e-2 * np.sqrt(np.mean(expected[:, j] ** 2))
            )


def test_torques_that_the_currents_of_a_drive_wired_backwards_show_are_the_same(axes):
    logs = real_logs(Truth(), PAYLOADS, np.random.default_rng(5), noise=0.0)
    turned = np.array([1.0, -1.0, 1.0])
    problem, mirrored = (problem_of(axes, [replace(log, v=log.v * by) for log in logs]) for by in (1.0, turned))
    _, plain = fitted_to(problem)
    loads = tuple(
        replace(own, names=(*own.names, "load"), motion=(*own.motion, -1)) for own in plain.own
    )  # friction in proportion to the load, whose coefficient has no unit and no sign of the wiring

    def rubbing(by: np.ndarray) -> Fitted:
        fit = plain.fit
        phi = tuple(np.append(each * sign, 0.13) for each, sign in zip(fit.phi, by, strict=True))
        return replace(plain, own=loads, fit=replace(fit, phi=phi, found=replace(fit.found, h=fit.found.h * by)))

    for number, (one, other) in enumerate(zip(problem.motions, mirrored.motions, strict=True)):
        expected, found = transmitted(one, number, rubbing(np.ones(N))), transmitted(other, number, rubbing(turned))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_noise_of_currents_reaches_what_compliance_does_along_them_in_as_many_directions_as_there_are_columns(axes):
    rng = np.random.default_rng(7)
    logs = real_logs(Truth(compliance=(2e-4, 1.5e-4, 2e-4)), PAYLOADS, rng, noise=0.0)
    noisy = [replace(log, v=log.v + 0.05 * log.v.std(axis=0) * rng.standard_normal(log.v.shape)) for log in logs]
    ready, plain = fitted_to(problem_of(axes, logs))
    loud = replace(ready, problem=problem_of(axes, noisy))
    first = torque_terms(ready.problem, ready.shared, plain.own, plain.fit, compliance=True)
    beside = [{"spare": rng.standard_normal(len(each))} for each in first.softened]
    quiet, found = (by_currents(each, first, plain, beside) for each in (ready, loud))
    change = [
        torques(ready.problem, motion, ready.shared, plain.fit.found.theta).softened(transmitted(motion, number, plain))
        for each in (ready, loud)
        for number, motion in enumerate(each.problem.motions)
    ]
    for j, (columns, own) in enumerate(zip(ready.columns, plain.own, strict=True)):
        parts = [of_rows(ready.problem.motions[k % 2], each, j) for k, each in enumerate(change)]
        whole = np.vstack(parts[2:]) - np.vstack(parts[:2])
        directions = columns.shared.shape[1] + own.F.shape[1] + N + 2  # the payload's and the spare one
        explained = np.linalg.norm(found[j] - quiet[j], axis=0) / np.linalg.norm(whole, axis=0)
        # White noise of r rows has the share d / r of its power in d directions; of low-passed one it is up to thrice.
        assert (explained**2 < 3.0 * directions / len(whole)).all()
        assert (explained > 0.0).all()
        left = np.vstack(parts[2:]) - found[j]
        for exact in (columns.shared, columns.known[:, None], own.F, first.softened[j], beside[j]["spare"][:, None]):
            size = np.linalg.norm(left, axis=0) * np.linalg.norm(exact, axis=0)[:, None]
            assert (np.abs(exact.T @ left) <= 1e-9 * size).all()  # a regression's residual is orthogonal to each


def swinging_logs() -> list[Recording]:
    """Links that swing beside their motion; motors are ahead of them by what their transmissions yield."""
    rng, logs = np.random.default_rng(3), list[Recording]()
    for payload in PAYLOADS:
        motion = fourier(rng, MIDDLE)
        t = np.arange(0.0, motion.period, 1.0 / 500.0)
        link = list(motion(t))
        for k, w in enumerate(SWING):
            size, phase = 4e-3 * (1.0 + np.sin(0.7 * t + k)), w * t + rng.uniform(0.0, 6.0)
            spline = make_interp_spline(t, size * np.sin(phase), k=7)
            for order, x in enumerate(link):
                x[:, k] += spline.derivative(order)(t)
        rigid = torque(with_payload(three_axes(), payload), *link)
        yielding = make_interp_spline(t, rigid, k=5)
        q, dq = (x + SOFT * yielding.derivative(order)(t) for order, x in enumerate(link[:2]))
        v = Truth().motor_torque(rigid, dq) / GAIN
        logs.append(Recording(t, q, v + 0.01 * v.std(axis=0) * rng.standard_normal(v.shape)))
    return logs


def test_gains_of_links_that_swing_near_their_resonance_come_back_along_the_torques_of_currents(axes):
    problem = problem_of(axes, swinging_logs())
    found = all_joints_gains(problem, AllJointsOptions(zero_std=0.0, tilt_std=0.0))  # zeros are right here
    assert "joint elasticity detected and modelled" in found.remarks
    # Taken for stiff, gains are off by -26, -11 and 8 %; along the torques of stiff joints by -.5, -2.2 and 2.3 %.
    assert (np.abs(1.0 / found.solution.inverse / GAIN - 1.0) < 5e-3).all()
    assert (np.abs(found.gain - GAIN) < 2.0 * found.std).all()


def test_a_named_model_of_yielding_joints_goes_along_the_torques_of_currents_as_well(axes):
    problem = problem_of(axes, swinging_logs())
    told = AllJointsOptions(friction="viscous-coulomb", compliance=True, zero_std=0.0, tilt_std=0.0)
    inverse = all_joints_gains(problem, told).solution.inverse
    assert (np.abs(1.0 / inverse / GAIN - 1.0) < 1e-2).all()
