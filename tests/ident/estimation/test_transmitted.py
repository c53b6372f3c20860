"""Torques that currents show and what compliance does along them, beside inverse dynamics by Pinocchio."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from consistency_logs import PAYLOADS, logs_of, problem_of, ready_of
from exact import full_rate, shared_columns
from known_logs import fourier, torque, with_payload
from real_friction import GAIN, MIDDLE, RATE, Truth, three_axes
from scipy.interpolate import make_interp_spline

from ident.estimation.all_joints import Fit, fit
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.problem import Columns, Problem
from ident.estimation.setting import Setting, Term
from ident.estimation.sweep import NOISE_SHARE, inertia_matrices, own_rotors, separate_rotors, shown_hz
from ident.estimation.terms import (
    columns_along,
    compliance_columns,
    load_terms,
    torques_of,
    transmitted,
    transmitted_columns,
    without_friction,
)
from ident.model.arm import with_transmission
from ident.model.displacement import Dynamics
from ident.model.regressor import inverse_dynamics
from ident.numerics.signals import low_passed, smooth_motion
from ident.observation.full_rate import FullRate
from ident.recordings.recording import Recording

N = 3
SWING = 2.0 * np.pi * np.array([3.1, 4.3, 6.5])
"""Of each link [rad/s]."""
SOFT = np.array([1e-4, 1e-4, 1e-4])
"""Compliance of each transmission [rad/(N m)]."""


def fitted_to(problem: Problem) -> tuple[Setting, Fit]:
    ready = ready_of(problem)
    return ready, fit(ready, {}, None)


@pytest.mark.parametrize(
    ("form", "wired"), [("", 1.0), ("load", -1.0), ("load-through", -1.0), ("load-motor", -1.0), ("load-motor", 1.0)]
)
def test_friction_that_is_taken_off_a_current_leaves_that_of_the_links(form, wired):
    rng = np.random.default_rng(1)
    x, dq = 5.0 * rng.standard_normal(400), rng.standard_normal(400)
    value = {"Fv": 0.4, "Fc": 0.3, "off": -0.2, "cbrt": 0.25, "by-direction": 0.15} | ({form: 0.1} if form else {})
    value |= {"offset-share": 0.65} if form == "load-motor" else {}
    own = {(name, 1 if name in ("Fv", "Fc") else -1): np.array([x, 3.0 * x]) for name, x in value.items()}
    own |= {("Fv", 0): np.array([7.0, 7.0]), ("Fc", 0): np.array([9.0, 9.0])}  # another motion's
    turns = wired * np.sign(dq)
    brakes = 0.4 * dq + 0.3 * np.sign(dq) - 0.2 + 0.25 * np.cbrt(dq) + 0.15 * np.abs(dq)
    carried = x + brakes
    V = carried + 0.1 * turns * {"load": np.abs(x), "load-through": np.abs(carried)}.get(form, 0.0)
    for _ in range(60 if form == "load-motor" else 0):
        V = carried + 0.1 * (0.35 * np.abs(V) + 0.65 * np.abs(V + 0.2)) * turns  # 0.65 of the offset is no torque
    two = (np.column_stack((each, each[::-1])) for each in (V, dq))  # the second joint has other friction
    told = SimpleNamespace(
        h=wired * np.array([0.7, 2.0]), phi=np.column_stack(list(own.values())),
        model=SimpleNamespace(names=tuple(own)), common=lambda name, other: own.get((name, -1), np.full(2, other)),
    )  # fmt: skip
    found = without_friction(*two, told, 1)
    np.testing.assert_allclose(found[:, 0], x, rtol=0, atol=1e-12)
    assert np.abs(found[::-1, 1] - x).min() > 0.0


@pytest.mark.parametrize("beside", [-1, 0, 1])
def test_a_motor_that_also_turns_by_another_angle_carries_another_torque(axes, beside):
    problem = problem_of(axes, logs_of(Truth(), noise=0.0))
    ready, plain = fitted_to(problem)
    (along, *_) = torques_of(ready, plain.theta)
    chi = along.chi.copy()
    chi[np.setdiff1d(own_rotors(axes), separate_rotors(axes))] = 0.0  # the inertia of links and rotor together
    chi[separate_rotors(axes)] += 0.37
    along = replace(along, chi=chi)
    states, step, found = along.sweep.behind.states, 1e-6, along.turned((1, beside))[..., N:]
    for motor in range(max(0, -beside), N - max(0, beside)):
        A = np.eye(N)
        A[motor, motor + beside] += step
        moved = inverse_dynamics(with_transmission(axes.arm, A), along.chi, states.q, states.dq, states.ddq)
        change = (moved - along.sampled) / step  # of second order by the step, to rounding of torques over it
        np.testing.assert_allclose(found[..., motor], change, rtol=0, atol=1e-5 * np.abs(change).max())


def test_a_motion_in_pieces_has_the_torques_of_the_whole(axes, monkeypatch):
    problem = problem_of(axes, logs_of(Truth(), noise=0.0))
    ready, plain = fitted_to(problem)
    (along, *_) = torques_of(ready, plain.theta)
    whole = along.sampled, along.softened(), along.by(Dynamics.misplaced)
    monkeypatch.setattr("ident.support.arrays.PIECE", len(along.sampled) // 3 + 1)
    observed = replace(along.sweep.motion.observation)  # without what is kept
    motions = (replace(along.sweep.motion, observation=observed), *problem.motions[1:])
    pieces = replace(along, sweep=replace(along.sweep, problem=replace(problem, motions=motions)))
    for found, expected in zip((pieces.sampled, pieces.softened(), pieces.by(Dynamics.misplaced)), whole, strict=True):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("late", [0.0, 0.016])
def test_torques_that_currents_show_are_those_of_links_and_payload(axes, late):
    # The same currents, stamped two samples early, with a delay that says so.
    logs = logs_of(Truth(), noise=0.0)
    stamped = [replace(log, v=np.roll(log.v, -round(late * RATE), axis=0)) for log in logs]
    problem = problem_of(axes, stamped, current_delay=late)
    ready, plain = fitted_to(problem)
    np.testing.assert_allclose(1.0 / plain.h, GAIN, rtol=3e-3)
    for number, motion in enumerate(problem.motions):
        behind = motion.observation.full_rate
        assert behind is not None
        expected = torque(with_payload(three_axes(), PAYLOADS[number]), behind.q, behind.dq, behind.ddq)
        found = transmitted(ready.sweeps[number], plain)
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


def test_what_compliance_does_along_the_torques_of_currents_is_its_regression_on_columns_from_positions(axes):
    # so that noise of currents reaches it in as many directions as there are columns; those of an earlier fit's load
    # would add the changes from pass to pass, which are noise near convergence
    ready, plain = fitted_to(problem_of(axes, logs_of(Truth(compliance=(2e-4, 1.5e-4, 2e-4)))))
    along, columns = torques_of(ready, plain.theta), Columns.of(ready.problem.motions)
    loaded = fit(ready, {"load": Term(load_terms(ready, plain, along, ["load"])["load"]["load"], 0.04, 0.03)}, plain)
    first, spare = compliance_columns(ready.columns, along), np.random.default_rng(7).standard_normal(len(columns.V))
    spare[columns.joint == 1] *= 1e-15  # rounding errors of a column that this joint does not have
    found = transmitted_columns(replace(ready, softened=first), loaded, along, [spare])
    whole = [each.sweep.rows(each.softened(transmitted(each.sweep, loaded)[each.sweep.behind.at])) for each in along]
    W = np.column_stack((shared_columns(ready), *columns.W_L, ready.F, first, spare))
    for j in range(N):
        own = columns.joint == j  # a payload's YY does not act on the first joint either
        unit = W[own] / np.maximum(np.linalg.norm(W[own], axis=0), 1e-6 * np.linalg.norm(W, axis=0))
        expected = unit @ np.linalg.lstsq(unit, ready.columns.of_logs(whole)[own], rcond=1e-9)[0]
        np.testing.assert_allclose(found[own], expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_joints_yield_beside_the_friction_of_the_fit_whose_torques_they_carry(axes):
    ready, plain = fitted_to(problem_of(axes, logs_of(Truth(compliance=(2e-4, 1.5e-4, 2e-4)))))
    spare, elastic = np.random.default_rng(7).standard_normal(len(ready.columns.V)), np.array([0, 2])
    wide, loads = columns_along(ready, plain, ["load"], elastic, {"spare": Term(spare)})
    along = torques_of(ready, plain.theta)
    softened = replace(ready, softened=compliance_columns(ready.columns, along))
    expected = transmitted_columns(softened, plain, along, [spare, loads["load"]["load"]])[:, elastic]
    found, other = (fit(each, {}, plain).theta[-2:] for each in (wide, ready.widened(expected)))
    np.testing.assert_allclose(found, other, rtol=1e-9)


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
    told = AllJointsOptions(friction="viscous-coulomb", compliance=True, zero_std=0.0, tilt_std=0.0)
    inverse = all_joints_gains(problem, told).solution.inverse  # of a named model as well
    assert (np.abs(1.0 / inverse / GAIN - 1.0) < 1e-2).all()


# What is let in beside encoder noise, against closed forms and noise that is made

PERIOD, CUTOFF = 4e-3, 15.0
M = np.array([[3.1, 0.7], [0.7, 0.4]])
NOISE = np.array([3e-12, 8e-12])
DENSITY = np.array([3.1**2 * (3.1**2 * 3e-12 + 0.7**2 * 8e-12), 0.4**2 * (0.7**2 * 3e-12 + 0.4**2 * 8e-12)])
"""Of the noise that unit accelerations give, M_kk^2 (sum over l of M_kl^2 N_l)."""


def still(noise: np.ndarray, cutoff_hz: float = CUTOFF) -> FullRate:
    return full_rate(np.zeros((100_000, len(noise))), noise, period=PERIOD, cutoff_hz=cutoff_hz)


@pytest.fixture(scope="module")
def white() -> np.ndarray:
    return np.random.default_rng(4).standard_normal((100_000, 2))


def test_noise_is_let_in_up_to_its_share_of_the_power(white):
    # P f of a white signal against D (2 pi)^8 f^9 / 9 of the noise: equal shares at f^8 = 9 share P / (D (2 pi)^8).
    expected = np.array([7.3, 13.6])
    power = DENSITY * (2.0 * np.pi) ** 8 * expected**8 / (9.0 * NOISE_SHARE)
    own = white * np.sqrt(power / (2.0 * PERIOD))
    # Spectra of 60 periods have lines each 2/3 Hz, of which the last one counts whole: the limit is half a line to one
    # and a half too low.
    found = shown_hz(still(NOISE, cutoff_hz=40.0), own, M**2)
    np.testing.assert_allclose(found, expected - 2.0 / 3.0, rtol=0, atol=0.4)


def test_what_is_nothing_but_encoder_noise_is_known_as_that(white):
    # The fourth derivative of white noise, low-passed as positions are, as loud as unit accelerations make it.
    quiet = smooth_motion(smooth_motion(white, PERIOD, CUTOFF)[2], PERIOD, 100.0)[2][2000:-2000]
    own = quiet * np.sqrt(DENSITY / (2.0 * PERIOD))
    for share, whole in ((0.75, True), (1.35, False)):
        found = shown_hz(still(share * NOISE_SHARE * NOISE), own, M**2)
        assert ((found == CUTOFF) == whole).all()


def test_a_compliance_is_slowed_by_its_own_noise_and_no_other_is(axes):
    # Encoder noise of the second joint alone, as loud as its compliance below some Hz.
    problem = problem_of(axes, logs_of(Truth()))
    ready = ready_of(problem)
    torques = torques_of(ready, fit(ready, {}, None).theta)[0]
    softened, behind = torques.softened(), torques.sweep.behind
    plain = torques.sweep.rows(softened)
    inertia = np.mean(inertia_matrices(torques.arm, torques.chi - torques.rotors, behind.states.q) ** 2, axis=0)
    own = torques.sweep.at_full_rate(np.einsum("skk->sk", softened))
    inertia[0, 1] = inertia[2, 1] = 0.0
    noise = np.array([0.0, 1e-12, 0.0])
    while shown_hz(replace(behind, noise=noise), own, inertia)[1] > 8.0:
        noise *= 2.0
    loud = replace(behind, noise=noise)
    limit = shown_hz(loud, own, inertia)
    assert limit[0] == limit[2] == CUTOFF
    motion = replace(problem.motions[0], observation=replace(problem.motions[0].observation, full_rate=loud))
    sweep = replace(torques.sweep, problem=replace(problem, motions=(motion, problem.motions[1])))
    found = replace(torques, sweep=sweep).slowed(softened)
    slow = low_passed(torques.sweep.at_full_rate(softened[:, :, 1]), behind.period, limit[1])
    np.testing.assert_array_equal(found[:, 1], sweep.decimated(slow[:, :, None])[:, 0])
    assert np.abs(found[:, 1] - plain[:, 1]).max() > 1e-4 * np.abs(plain[:, 1]).max()


def test_of_what_noise_drowns_at_every_frequency_only_the_slowest_is_let_in(white):
    found = shown_hz(still(NOISE), 1e-12 * white, M**2)
    np.testing.assert_allclose(found, 0.25, rtol=1e-12)  # one line of spectra of 60 periods of 15 Hz
