import os
import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import pinocchio_arm
from plants import BELIEF, RX90, experiment, nominal_plant, short_motion

import rx90_mjcf
from sim import effects as effects_package
from sim import feedforward_currents as needed_module
from sim.controller import tuned
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Effect
from sim.errors import PlantError
from sim.feedforward_currents import feedforward_currents as needed_in_turn
from sim.feedforward_currents import inertia_along, states_of
from sim.plant import PayloadBody

RATE = 200.0
BODY = PayloadBody(mass=5.3, com=(0.05, -0.03, 0.14), inertia=(0.0125, 0.0118, 0.009, 0.0006, -0.0004, 0.0003))
GAIN = np.array([-0.9, 1.2, 1.1, 0.8, -1.3, 1.4])
COMPLIANCE = (2e-5, 2.5e-5, 6e-5, 1e-4, 1.2e-4, 2e-4)
SPLINE = 2e-4
"""Largest error of a spline through 20 samples a period of the fastest harmonic, as a share of the largest torque."""


def plant_with(**errors):
    return nominal_plant(BODY, ModelErrors(**errors), gain=GAIN)


def motion_of(loaded: bool = True, earlier: int = 0, **errors):
    return experiment(plant=plant_with(**errors), loaded=loaded, earlier=earlier, trajectory=short_motion(4.0, 0.2))


def feedforward_currents(motion, rate):
    return needed_in_turn([motion], rate)[0]


def states(motion, rate=RATE):
    t = states_of(motion.trajectory, rate).t
    return t, *motion.trajectory(t)


def link_torque(q, dq, ddq):
    arm = pinocchio_arm(payload=True, body=BODY)
    data = arm.createData()
    return np.array([pin.rnea(arm, data, *each) for each in zip(q, dq, ddq, strict=True)])


def drive_torque(motion, v):
    """Torque behind amplifier offset and asymmetry, before friction."""
    d = motion.plant.drives
    return d.gain * (v - d.amplifier_offset) - d.coulomb_asymmetry


def rigid_torque(motion):
    _, q, dq, ddq = states(motion)
    return link_torque(q, dq, ddq) + motion.plant.drives.rotor_inertia * ddq


def check(torque, expected):
    np.testing.assert_allclose(torque, expected, rtol=0, atol=SPLINE * np.abs(expected).max())


def test_a_motion_needs_pinocchio_s_torque_its_rotors_and_the_friction_that_is_stated():
    motion = motion_of(
        earlier=2,
        coulomb_drift=0.05,
        viscous_drift=-0.03,
        coulomb_by_direction=0.3,
        viscous_by_direction=-0.2,
        stribeck=0.15,
        transmitted_friction=0.08,
    )
    d, (_, q, dq, ddq) = RX90.drives, states(motion)
    dry = 1.05**2 * d.coulomb_friction * (1.0 + 0.15 * np.exp(-((dq / 0.1) ** 2))) * (1.0 + 0.15 * np.sign(dq))
    dry += 0.08 * np.abs(link_torque(q, dq, ddq))
    viscous = 0.97**2 * d.viscous_friction * (1.0 - 0.1 * np.sign(dq))
    expected = rigid_torque(motion) + dry * np.sign(dq) + viscous * dq
    torque = drive_torque(motion, feedforward_currents(motion, RATE))
    check(torque, expected)
    off = np.abs(torque - expected).max(axis=1)  # a periodic motion is as exact at its ends
    assert max(off[:8].max(), off[-8:].max()) <= off[8:-8].max()


def test_load_friction_takes_its_share_of_the_torque_that_the_current_gives():
    c, d, motion = 0.07, RX90.drives, motion_of(load_friction=0.07)
    _, _, dq, _ = states(motion)
    plain = rigid_torque(motion) + d.viscous_friction * dq + d.coulomb_friction * np.sign(dq)
    motor = drive_torque(motion, feedforward_currents(motion, RATE)) + d.coulomb_asymmetry  # g (v - v0)
    # c |motor| sign(dq) + plain + Fcoff = motor: 1 - c where the motor drives, 1 + c where it brakes.
    driving = np.sign(plain + d.coulomb_asymmetry) * np.sign(dq)
    check(motor, (plain + d.coulomb_asymmetry) / (1.0 - c * driving))


def test_friction_that_eats_all_torque_and_play_that_a_motion_goes_through_are_refused():
    with pytest.raises(PlantError, match="motion: no current moves the arm: load-dependent friction"):
        feedforward_currents(motion_of(load_friction=1.3), RATE)
    with pytest.raises(PlantError, match="joints are inside their backlash gaps"):
        feedforward_currents(motion_of(joint_compliance=COMPLIANCE, backlash=1e-3), RATE)


@pytest.mark.parametrize(
    "effects",
    [
        {"load_friction": 0.07, "stribeck": 0.15},
        {"presliding": 4e-3, "wrist_coupling": 0.4, "transmitted_friction": 0.08, "dress_pack": 0.03},
        {"motor_warming": 70.0, "warming_time": 3.0, "gain_by_temperature": -0.003, "viscous_by_temperature": -0.02},
        {"cogging": 0.02, "torque_ripple": 0.04, "motor_waves": 9.0, "viscous_curve": 0.6},
    ],
    ids=" ".join,
)
def test_an_effect_that_is_asked_moment_by_moment_gives_the_same(effects, monkeypatch):
    motion = motion_of(**effects)
    at_once = feedforward_currents(motion, 50.0)
    slow = {name: type(name, (effect,), {"instant": False, "along": Effect.along}) for name, effect in EFFECTS.items()}
    monkeypatch.setattr(needed_module, "EFFECTS", slow)
    needed_module._settled.cache_clear()  # of what was found at once
    np.testing.assert_allclose(feedforward_currents(motion, 50.0), at_once, rtol=1e-12)  # rounding
    assert effects_package.EFFECTS is EFFECTS


def test_links_behind_elastic_transmissions_give_way_by_what_they_carry():
    motion = motion_of(joint_compliance=COMPLIANCE)
    slow = 30.0  # what gives way in turns must lie below the resonances
    t, q, dq, ddq = states(motion, slow)
    d, C = RX90.drives, np.array(COMPLIANCE)
    lag = 0.1 * np.sqrt(C * d.rotor_inertia)  # damping over stiffness [s]: 2 zeta sqrt(Ke Ia) / Ke, zeta = 0.05
    period, inner = t[1] - t[0], slice(None, -1)
    q, dq, ddq = q[inner], dq[inner], ddq[inner]

    def rate(x, order):
        w = 2j * np.pi * np.fft.rfftfreq(len(x), period)[:, None]
        return np.fft.irfft(w**order * np.fft.rfft(x, axis=0), len(x), axis=0)

    carried = link_torque(q, dq, ddq)
    for _ in range(6):  # by a thirtieth of itself each
        w = 2j * np.pi * np.fft.rfftfreq(len(q), period)[:, None]
        give = np.fft.irfft(C * np.fft.rfft(carried, axis=0) / (1.0 + lag * w), len(q), axis=0)
        carried = link_torque(q - give, dq - rate(give, 1), ddq - rate(give, 2))
    friction = d.viscous_friction * dq + d.coulomb_friction * np.sign(dq)
    found = drive_torque(motion, feedforward_currents(motion, slow))[inner]
    stiff = link_torque(q, dq, ddq) + d.rotor_inertia * ddq + friction
    difference = carried + d.rotor_inertia * ddq + friction - stiff
    # The difference is what counts; yielding four times leaves 1 % of it.
    assert np.abs(difference).max() > 0.5
    np.testing.assert_allclose(found - stiff, difference, rtol=0, atol=0.03 * np.abs(difference).max())


def test_the_inertia_along_a_motion_is_pinocchio_s_with_rotors():
    motion = motion_of(joint_compliance=COMPLIANCE)
    arm, (_, q, _, _) = pinocchio_arm(payload=True, body=BODY), states(motion)
    found = inertia_along(motion, RATE)
    data = arm.createData()
    expected = np.empty_like(found)
    for k, each in enumerate(q):
        M = np.triu(pin.crba(arm, data, each))
        expected[k] = M + np.triu(M, 1).T + np.diag(RX90.drives.rotor_inertia)
    # Straight lines between ten samples a period: their sag is (pi / 10)^2 / 2 of what varies.
    np.testing.assert_allclose(found, expected, rtol=0, atol=0.05 * np.ptp(expected, axis=0).max())


def test_a_model_file_that_has_changed_is_read_again(tmp_path):
    model = tmp_path / "arm.xml"

    def drawn(factor: float, stamp: int):
        text = re.sub(r'\bmass="([^"]+)"', lambda each: f'mass="{factor * float(each[1])}"', rx90_mjcf.MJCF.read_text())
        model.write_text(text)
        os.utime(model, ns=(stamp, stamp))

    drawn(1.0, 10**18)
    plain = motion_of(loaded=False)
    robot = RX90.model_copy(update={"model": model})
    plant = replace(plain.plant, robot=robot)
    motion = replace(plain, plant=plant, belief=replace(BELIEF, robot=robot))
    before, table = feedforward_currents(motion, RATE), tuned(motion.belief, motion.trajectory, motion.controller)
    drawn(1.7, 10**18 + 3)
    after, later = feedforward_currents(motion, RATE), tuned(motion.belief, motion.trajectory, motion.controller)
    new = replace(
        motion, plant=replace(plant, robot=RX90.model_copy(update={"model": model}))
    )  # nothing is kept of this robot
    np.testing.assert_array_equal(after, feedforward_currents(new, RATE))
    assert np.abs(after - before).max() > 1.0
    assert np.abs(later.reference - table.reference).max() > 1.0


def warming_up(plain, drives, x):
    """Currents of drives that weaken by 0.4 % a kelvin, beside those of cold ones, and how warm they become [K]."""
    v = np.empty_like(plain)
    for k, cold in enumerate(plain):
        v[k] = drives.amplifier_offset + (cold - drives.amplifier_offset) / (1.0 - 0.004 * x)
        settled = 300.0 * (v[k] / drives.current_limit) ** 2
        x = settled + (x - settled) * np.exp(-1.0 / RATE / 2.5)
    return v, x


def test_each_sample_has_the_warmth_of_all_before_it_of_the_warm_up_and_of_the_pause():
    hot = {"motor_warming": 300.0, "warming_time": 2.5, "gain_by_temperature": -0.004}
    motions = [
        replace(motion_of(loaded=bool(k), earlier=k, **hot), name=f"motion {k}", warm_up=3.1, pause=0.7)
        for k in range(2)
    ]
    d, x = motions[0].plant.drives, np.zeros(6)
    bare, loaded = (feedforward_currents(motion_of(loaded=each), RATE) for each in (False, True))
    for share in (0.5, 1.0):  # a warm-up under the load of its middle
        load = np.mean((warming_up(bare, d, x)[0] / d.current_limit) ** 2, axis=0)
        x = 300.0 * load * (1.0 - np.exp(-share * 3.1 / 2.5))
    expected = list[np.ndarray]()
    for plain in (bare, loaded):
        v, x = warming_up(plain, d, x)
        expected.append(v)
        x = x * np.exp(-0.7 / 2.5)
    for found, v, plain in zip(needed_in_turn(motions, RATE), expected, (bare, loaded), strict=True):
        assert np.abs(v - plain).max() > 0.01 * np.abs(plain).max()
        np.testing.assert_allclose(found, v, rtol=0, atol=1e-8 * np.abs(v).max())  # a search that ends at 1e-10
