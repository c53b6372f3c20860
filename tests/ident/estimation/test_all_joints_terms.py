"""Columns that follow from speed and torque, beside inverse dynamics by Pinocchio and friction laws solved anew."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from consistency_logs import logs_of, problem_of, ready_of
from known_logs import BRICK, torque, with_payload
from pinocchio_arms import standard_parameters_of
from real_friction import GAIN, Truth, three_axes
from scipy import interpolate
from scipy.interpolate import make_interp_spline

from ident.estimation.all_joints import Fit, fit
from ident.estimation.setting import Setting, Term
from ident.estimation.sweep import Sweep, Torques, inertia_matrices, rotor_inertia
from ident.estimation.terms import LOAD_FORMS, SPEED_TERMS, load_terms, speed_terms, torques_of
from ident.observation.full_rate import FullRate

N = 3
HEAVY, LIGHT = replace(BRICK, known="com"), replace(BRICK, mass=2.9, com=(-0.04, 0.06, 0.03), known="mass")


@pytest.fixture(scope="module")
def ready(axes) -> Setting:
    payloads = (None, HEAVY, LIGHT)
    return ready_of(problem_of(axes, logs_of(Truth(load_motor=(0.03, 0.05, 0.08)), 3, payloads), payloads))


@pytest.fixture(scope="module")
def plain(ready) -> Fit:
    return fit(ready, {}, None)


def behind(ready: Setting, motion: int) -> FullRate:
    return ready.sweeps[motion].behind


def of_motion(sweep: Sweep, signal: np.ndarray, joint: int) -> np.ndarray:
    """A signal as rows of a joint: samples left out, then a convolution, then one in so many."""
    full = sweep.behind
    smooth = np.convolve(np.where(full.moving[:, joint], signal, 0.0), full.decimator.kernel, mode="valid")
    return smooth[:: full.decimator.factor][sweep.motion.observation.joints[joint].position]


def of_rows(ready: Setting, signals: list[np.ndarray], joint: int) -> np.ndarray:
    """Signals of the three motions as rows of a joint."""
    return np.concatenate([of_motion(*each, joint) for each in zip(ready.sweeps, signals, strict=True)])


def theta_of(ready: Setting, Ia: np.ndarray) -> np.ndarray:
    """Shared parameters of the arm as Pinocchio has it, rotors of inertia Ia, and of payloads that are half known."""
    chi = np.column_stack((standard_parameters_of(three_axes()), Ia, np.zeros((N, 3))))
    free = (each.known_part().chi[at] for each, at in zip((HEAVY, LIGHT), ready.shared.free, strict=True))
    return np.concatenate(((ready.problem.structure.base.regrouping @ chi.ravel())[ready.shared.arm], *free))


def rotors(ready: Setting) -> np.ndarray:
    """Rotor inertias of the joints whose links have no inertia that looks the same: of axis 2, YY2 does."""
    groups = ready.problem.structure.base.groups()
    return np.array([1.7 + j if list(groups.get(f"Ia{j + 1}", ())) == [f"Ia{j + 1}"] else 0.0 for j in range(N)])


@pytest.mark.parametrize(("motion", "payload"), [(0, None), (1, BRICK), (2, LIGHT)])
def test_rigid_torques_are_those_of_inverse_dynamics(ready, motion, payload):
    Ia, full = rotors(ready), behind(ready, motion)
    np.testing.assert_array_equal(Ia, [0.0, 0.0, 3.7])
    found = ready.sweeps[motion].at(theta_of(ready, Ia))
    states = full.q, full.dq, full.ddq
    expected = torque(with_payload(three_axes(), payload), *states) + Ia * full.ddq
    # LIGHT's unknown parameters are found up to what the arm's own kinematics cannot tell apart: none of torque.
    whole = found.sweep.at_full_rate(found.sampled)
    np.testing.assert_allclose(whole, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def at_full_rate(along: Torques, change: np.ndarray) -> np.ndarray:
    return along.sweep.at_full_rate(change.reshape(len(change), -1)).reshape(-1, *change.shape[1:])


def test_torques_between_evaluated_samples_are_splines(ready):
    # At 1 / 8 of the sampling period each sample is evaluated; at 8 of it, splines lie between, of signals below 15 Hz.
    motion, theta = ready.problem.motions[1], theta_of(ready, rotors(ready))
    slow = replace(behind(ready, 1), cutoff_hz=4.1)
    sparse = replace(motion, observation=replace(motion.observation, full_rate=slow))
    motions = (ready.problem.motions[0], sparse, ready.problem.motions[2])
    one, other = (
        replace(ready.sweeps[1], problem=replace(ready.problem, motions=each)).at(theta)
        for each in (ready.problem.motions, motions)
    )
    t, knots = slow.t, other.sweep.knots
    assert len(knots) < 0.4 * len(t)
    assert (slow.at[-1] - slow.at[-2]) != slow.at[1]  # the last interval is shorter
    for fine, coarse in ((one.sampled, other.sampled), (one.softened(), other.softened())):
        found, spline = at_full_rate(other, coarse), interpolate.CubicSpline(knots, coarse)(t)
        np.testing.assert_allclose(found, spline, rtol=0, atol=1e-12 * np.abs(fine).max())
        if coarse.ndim == 3:
            each = [[of_motion(other.sweep, x, j) for x in found[:, j].T] for j in range(N)]
            expected = np.vstack([np.transpose(rows) for rows in each])
            np.testing.assert_allclose(other.sweep.rows(coarse), expected, rtol=0, atol=1e-12 * np.abs(fine).max())
        # Torques of up to 1 Hz, known at 31: a spline is off by some (1 / 31)^4 in them, (1 / 31)^2 in what their
        # second derivative makes, and by more at the ends.
        inner = slice(40, -40)
        fine = at_full_rate(one, fine)[inner]
        np.testing.assert_allclose(found[inner], fine, rtol=0, atol=2e-3 * np.abs(fine).max())


def test_a_longer_duration_of_a_motion_changes_its_torques(ready):
    along, h = ready.sweeps[1].at(theta_of(ready, rotors(ready))), 1e-4
    q, dq, ddq = (getattr(along.sweep.behind.states, name) for name in ("q", "dq", "ddq"))
    longer, shorter = (torque(with_payload(three_axes(), BRICK), q, dq / x, ddq / x**2) for x in (1.0 + h, 1.0 - h))
    expected = (longer - shorter) / (2.0 * h) - 2.0 * rotors(ready) * ddq
    # A central difference is off by h^2 of a third derivative, which is six times the torque.
    np.testing.assert_allclose(along.slowed_down()[..., 0], expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize(("motion", "payload"), [(0, None), (1, BRICK)])
def test_compliance_moves_torques_as_links_behind_their_motors_do(ready, motion, payload):
    Ia, full = rotors(ready), behind(ready, motion)
    along = ready.sweeps[motion].at(theta_of(ready, Ia))
    found = at_full_rate(along, along.softened())
    heavy, t = with_payload(three_axes(), payload), np.arange(len(full.q)) * full.period
    stiff = torque(heavy, full.q, full.dq, full.ddq)
    turned = make_interp_spline(t, stiff, k=5)
    inner = slice(40, -40)  # the derivatives of splines at their ends
    for k in range(N):
        # 1e-6 rad/(N m) and some 100 N m turn a link by a tenth of a milliradian: first order to 1e-4.
        C = 1e-6 * (np.arange(N) == k)
        moved = (x - C * turned.derivative(order)(t) for order, x in enumerate((full.q, full.dq, full.ddq)))
        slope = (torque(heavy, *moved) - stiff) / 1e-6
        assert np.abs(slope[inner]).max() > 1.0
        np.testing.assert_allclose(found[inner, :, k], slope[inner], rtol=0, atol=1e-3 * np.abs(slope[inner]).max())


def test_speed_terms_are_the_root_and_the_size_of_the_speed(ready):
    found, joint = speed_terms(ready, tuple(SPEED_TERMS)), ready.columns.joint
    assert set(found) == {"cbrt", "by-direction"}
    assert {each.std for each in found.values()} == {np.inf}  # nothing is believed of them
    for j in range(N):
        dq = [behind(ready, k).dq[:, j] for k in range(3)]
        root = of_rows(ready, [np.sign(x) * np.abs(x) ** (1.0 / 3.0) for x in dq], j)
        np.testing.assert_allclose(found["cbrt"].column[joint == j], root, rtol=0, atol=1e-12)
        size = of_rows(ready, [np.abs(x) for x in dq], j)
        np.testing.assert_allclose(found["by-direction"].column[joint == j], size, rtol=0, atol=1e-12)


def with_values(fitted: Fit, **values: float) -> Fit:
    """The same fit with other own values, by name; those of a motion times its number and one."""
    told, names = replace(fitted), fitted.model.names
    phi = np.array([values[name] * (1.0 + max(0, which)) for name, which in names])
    vars(told)["phi"] = np.where(fitted.model.own.used, phi, 0.0)
    return told


@pytest.mark.parametrize("form", [None, "load-through", "load-motor"])
def test_load_friction_is_in_proportion_to_the_torque_that_contains_it(ready, plain, form):
    terms, joint = speed_terms(ready, tuple(SPEED_TERMS)), ready.columns.joint
    if form:
        terms[form] = Term(load_terms(ready, plain, torques_of(ready, plain.theta), [form])[form][form])
    values = {"Fv": 0.4, "Fc": 0.3, "off": -0.2, "cbrt": 0.25, "by-direction": 0.15}
    values |= {"load-through": 0.11, "load-motor": 0.07}
    fitted = with_values(fit(ready, terms, plain), **values)
    along = torques_of(ready, fitted.theta)
    found = load_terms(ready, fitted, along, tuple(LOAD_FORMS))
    h = fitted.h
    np.testing.assert_array_equal(np.sign(h), np.sign(GAIN))
    inertia = rotor_inertia(ready.sweeps[0], fitted.theta)
    assert (inertia > 0.0).any()
    told = rotors(ready) > 0.0
    assert set(told.tolist()) == {True, False}
    for j in range(N):
        expected: dict[tuple[str, str], list[np.ndarray]] = {}
        for k, drive in enumerate(along):
            full, c = behind(ready, k), 0.07 if form == "load-motor" else 0.0
            dq = full.dq[:, j]
            x, s = h[j] * drive.sweep.at_full_rate(drive.sampled)[:, j], np.sign(h[j]) * np.sign(dq)
            friction = (1.0 + k) * (0.4 * dq + 0.3 * np.sign(dq)) - 0.2 + 0.25 * np.cbrt(dq) + 0.15 * np.abs(dq)
            rotor = h[j] * inertia[j] * full.ddq[:, j]

            def braking(carried, c=0.0, s=s):
                W = carried
                for _ in range(60 if c else 0):  # W = carried + c |W| s, by iteration
                    W = carried + c * np.abs(W) * s
                return np.abs(W) * s

            twice = {} if told[j] else {"rotor-share": -2.0 * rotor}  # of what is half of all
            for name, carried, own, shares in (
                ("load", x - rotor, 0.0, twice),
                ("load-through", x - rotor + friction, 0.0, {"offset-share": 0.2, **twice}),  # the offset is -0.2
                ("load-motor", x + friction, c, {"offset-share": 0.2}),
            ):
                expected.setdefault((name, name), []).append(braking(carried, own))
                for share, more in shares.items():
                    size = values[name] if name == form else 0.05
                    change = size * (braking(carried + more, own) - braking(carried, own))
                    expected.setdefault((name, share), []).append(change)
        for (name, share), parts in expected.items():
            rows = of_rows(ready, parts, j)
            np.testing.assert_allclose(found[name][share][joint == j], rows, rtol=0, atol=1e-12 * np.abs(parts).max())
            assert np.abs(rows).max() > 5e-4
        shown = {(name, share) for name, own in found.items() for share in own if own[share][joint == j].any()}
        assert shown == expected.keys()


def test_the_inertia_beside_softened_torques_is_that_of_links_and_payload(ready):
    for number, payload in enumerate((None, BRICK, LIGHT)):
        full, found = behind(ready, number), ready.sweeps[number].at(theta_of(ready, rotors(ready)))
        inertia = np.mean(inertia_matrices(found.arm, found.chi - found.rotors, full.states.q) ** 2, axis=0)
        model = with_payload(three_axes(), payload)
        data, places = model.createData(), np.linspace(0, len(full.q) - 1, 16).astype(int)
        known = np.mean([pin.crba(model, data, full.q[k]) ** 2 for k in places], axis=0)
        # Positions are those of the samples where torques are evaluated, a few apart from every sixteenth part.
        np.testing.assert_allclose(inertia, known, rtol=0, atol=1e-2 * known.max())


def test_the_least_rotor_inertia_is_a_share_of_the_joint_s(ready, plain):
    theta, told, first = plain.theta, rotors(ready) > 0.0, ready.sweeps[0]
    free = rotor_inertia(first, theta)
    # Twice the assumed half of what is not told apart, and a mass matrix that is in proportion to its parameters.
    one, seven = (rotor_inertia(first, k * theta, least=3.0) for k in (1.0, 7.0))
    np.testing.assert_allclose(seven, 7.0 * one, rtol=1e-9)
    assert (one[told] > 3.0 * free[told]).all()
    np.testing.assert_array_equal(one[~told], free[~told])
    np.testing.assert_array_equal(rotor_inertia(first, theta, least=1e-6), free)
