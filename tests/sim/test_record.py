import time
from copy import copy
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from plants import CYLINDER, NOISY, experiment, nominal_plant, short_motion, streams, try_record
from refusals import refused

from ident.recordings.recording import Recording
from sim.controller import ControllerOptions, inverse_dynamics
from sim.effects import ModelErrors
from sim.engine import acting
from sim.errors import LIMIT_REACHED, SATURATED, PlantError, SimulationError, TrajectoryError
from sim.experiment import SATURATED_TOO_LONG, fault
from sim.feedforward_currents import check_torque_limits
from sim.plant import bare_arm, plant_model
from sim.record import record
from sim.sensors import SensorOptions, logged, noise_streams
from sim.trajectory import FourierTrajectory

SILENT = SensorOptions()
BRIEF = short_motion(0.3, 0.002)


def same(a: Recording, b: Recording) -> bool:
    return a.q.tobytes() == b.q.tobytes() and a.v.tobytes() == b.v.tobytes() and a.t.tobytes() == b.t.tobytes()


def test_experiments_of_any_duration_rate_step_and_layout_run_in_one_call_as_they_run_alone():
    elastic = ModelErrors(joint_compliance=(1e-4,) * 6)
    errors = ModelErrors(stribeck=0.4, load_friction=0.05, dress_pack=0.02, dress_reach=0.01, torque_ripple=0.03)
    varying = nominal_plant(errors=errors)  # one plant, which none changes
    other = replace(errors, stribeck=0.2, load_friction=0.1, presliding=0.004, dress_reach=0.02)
    several = [
        experiment(trajectory=short_motion(0.2, 0.001)),
        *(
            experiment(**{"trajectory": BRIEF} | changes)
            for changes in (
                {"plant": nominal_plant(errors=elastic)},
                {},
                {"controller": ControllerOptions(rate_hz=500.0)},
                {"controller": ControllerOptions(integral_hz=0.4, velocity_cutoff_hz=90.0)},
                {"step": 5e-4},
                {"plant": nominal_plant(errors=ModelErrors(wrist_coupling=1.0)), "loaded": True},
                {"plant": nominal_plant(errors=ModelErrors(gravity_spring=2e4)), "loaded": True},
                {"plant": varying},
                {"plant": varying, "trajectory": replace(BRIEF, sine=-BRIEF.sine)},
                {"plant": nominal_plant(errors=other, gain=1.2 * varying.drives.gain)},
            )
        ),
    ]
    together = record(several, streams(*range(11)), threads=2)
    for i, single in enumerate(several):
        assert same(together[i], record([single], streams(i), threads=1)[0])
        np.testing.assert_allclose(together[i].period, 1.0 / single.controller.rate_hz, rtol=1e-9)


def test_a_control_period_takes_as_long_in_small_steps_as_in_large_ones():
    coarse, fine = record([experiment(sensors=SILENT, step=h) for h in (1e-3, 5e-4)], streams(0, 0), threads=1)
    # The integrator is of first order: an error of about a step's travel, 1 ms at some 0.5 rad/s.
    np.testing.assert_allclose(coarse.q, fine.q, rtol=0, atol=1e-3)


def test_a_plant_that_cannot_be_built_is_the_outcome_of_its_own_experiment():
    stiff = nominal_plant(errors=ModelErrors(joint_compliance=(1e-9,) * 6))
    noisy = replace(NOISY, coloured_cutoff_hz=600.0)
    sound = experiment(trajectory=BRIEF)
    several = [experiment(plant=stiff), experiment(sensors=noisy), experiment(step=7e-4), sound]
    outcomes = try_record(several, streams(0, 1, 2, 3), threads=1)
    assert [type(outcome) for outcome in outcomes] == [PlantError, PlantError, PlantError, Recording]
    assert same(outcomes[3], record([sound], streams(3), threads=1)[0])


def test_clock_jitter_moves_time_stamps_by_its_deviation():
    still, options = np.ones((100_000, 1)), replace(NOISY, clock_jitter=2.5e-4)
    stamps = logged(still, still, 1000.0, options, noise_streams(np.random.default_rng(0))).t
    error = stamps - np.arange(100_000) / 1000.0
    # The variance of 1e5 even deviates is known to 0.28 % (kurtosis 1.8), the deviation to half of it; four of them.
    np.testing.assert_allclose(error.std(), 2.5e-4, rtol=0.006)
    assert np.abs(error).max() <= np.sqrt(3.0) * 2.5e-4 * (1 + 1e-9)
    with pytest.raises(PlantError, match=r"clock_jitter = 0\.0003 s at 1000 Hz: expected a quarter .* 0\.00025 s"):
        record([experiment(sensors=replace(SILENT, clock_jitter=3e-4))], streams(0), threads=1)


def test_encoder_is_the_first_and_current_the_second_child_of_an_experiment_s_generator():
    sensors = replace(SILENT, encoder_noise=1e-4, current_white=0.05, clock_jitter=1e-4)
    clean, noisy = (
        record([experiment(sensors=each, trajectory=BRIEF)], streams(3), threads=1)[0]
        for each in (replace(SILENT, encoder_noise=1e-4), sensors)
    )
    np.testing.assert_array_equal(noisy.q, clean.q)  # currents are logged with noise, and so are times
    encoder, current = np.random.default_rng(3).spawn(2)
    start = BRIEF(np.zeros(1))[0][0]
    np.testing.assert_array_equal(noisy.q[0], start + 1e-4 * encoder.standard_normal(6))
    noise = 0.05 * current.standard_normal(clean.v.shape) * np.sqrt(np.mean(clean.v**2, axis=0))
    # Two roundings of currents below 500.
    np.testing.assert_allclose(noisy.v, clean.v + noise, rtol=0, atol=1e-12)


WARM = {"motor_warming": 60.0, "warming_time": 1.2, "gain_by_temperature": -0.004, "viscous_by_temperature": -0.02}
SHORT = experiment(
    trajectory=short_motion(0.2, 0.0006), sensors=SILENT, plant=nominal_plant(errors=ModelErrors(**WARM)), step=5e-4
)


def sequence(*loaded: bool, warm_up: float = 0.0, pause: float = 0.0, **errors):
    plant = nominal_plant(errors=ModelErrors(**{**WARM, **errors}))
    return [
        replace(SHORT, name=f"motion {k}", plant=plant, loaded=x, earlier=k, warm_up=warm_up, pause=pause)
        for k, x in enumerate(loaded)
    ]


def warmth_by_hand(start: np.ndarray, v: np.ndarray, seconds: float = 1e-3) -> np.ndarray:
    """Of T dx/dt = W (v / v_max)^2 - x, each sample held."""
    x = start.copy()
    for row in 60.0 * (v / SHORT.plant.drives.current_limit) ** 2:
        x = row + (x - row) * np.exp(-seconds / 1.2)
    return x


def seen_warmth(experiments, monkeypatch) -> tuple[list, list[np.ndarray]]:
    """Recordings, and the temperatures that the motions started with."""
    starts: list[np.ndarray] = []

    def watched(*args, warmth=None, **rest):
        starts.append(np.zeros(6) if warmth is None else warmth.copy())
        return acting(*args, warmth=warmth, **rest)

    monkeypatch.setattr("sim.record.acting", watched)
    return record(experiments, streams(*range(len(experiments))), threads=1), starts


def test_drives_go_on_as_warm_as_the_motion_before_left_them_but_for_the_pause(monkeypatch):
    motions = sequence(False, True, False, pause=0.9)
    recordings, starts = seen_warmth(motions, monkeypatch)
    x = np.zeros(6)
    for recording, start in zip(recordings, starts, strict=True):
        np.testing.assert_allclose(start, x, rtol=1e-12, atol=1e-15)  # 200 roundings
        x = warmth_by_hand(x, recording.v) * np.exp(-0.9 / 1.2)
    assert starts[2].max() > 0.3


def test_a_warm_up_is_the_bare_motion_repeated_for_its_time_before_the_first(monkeypatch):
    # Four motions one after another. One takes a sixth of the time constant, so that heat near its end counts for more
    # than its mean: some per cent of what settles.
    motions = sequence(*[False] * 5)
    _, starts = seen_warmth(motions, monkeypatch)
    monkeypatch.undo()
    _, warmed = seen_warmth(sequence(False, warm_up=4 * 0.201), monkeypatch)
    assert len(warmed) == 3  # two of the warm-up, and the motion itself
    np.testing.assert_allclose(warmed[2], starts[4], rtol=0.1)
    assert not warmed[0].any()
    assert (warmed[1] < warmed[2]).all()
    monkeypatch.undo()
    _, loaded = seen_warmth(sequence(True, False, warm_up=4 * 0.201), monkeypatch)
    np.testing.assert_array_equal(loaded[2], warmed[2])
    assert len(loaded) == 4  # the second has no warm-up


def test_a_motion_without_the_one_before_it_is_refused():
    first, second, third = sequence(False, True, False)
    for wrong in ([second], [first, third], [second, first], [first, replace(second, plant=nominal_plant()), third]):
        outcomes = try_record(wrong, streams(*range(len(wrong))), threads=1)
        with pytest.raises(PlantError, match=r"motion \d: drives warm up, but the preceding"):
            raise next(o for o in outcomes if isinstance(o, Exception))


def test_after_a_motion_that_failed_there_is_none():
    first, second, third = sequence(False, True, False)
    limit = np.array([480.0, 50.0, 240.0, 110.0, 80.0, 45.0])
    broken = replace(first, plant=replace(first.plant, drives=replace(first.plant.drives, current_limit=limit)))
    outcomes = try_record([broken, second, third, *sequence(False)], streams(0, 1, 2, 3), threads=1)
    assert outcomes[0].kind == SATURATED
    assert outcomes[0] is outcomes[1] is outcomes[2]
    assert not isinstance(outcomes[3], Exception)
    for each in try_record([replace(broken, warm_up=2.2)], streams(0), threads=1):
        assert str(each).startswith("warm-up before motion 0: drive of joint2 at its limit")


STILL = [0.2, 0.3, 1.0, 0.1, 0.4, -0.2]
RUN = 100
"""Samples at 1 kHz that make a saturation too long."""


@pytest.fixture(scope="module")
def model():
    return plant_model(nominal_plant(), loaded=False, step=1e-3)


def fault_of(model, v: np.ndarray, q: np.ndarray | None = None):
    still = np.tile(STILL, (len(v), 1)) if q is None else q
    return fault(experiment(), model, still, v, unstable=False)


def test_a_tenth_of_a_second_at_the_limit_is_too_long_and_a_sample_less_is_not_and_the_first_is_named(model):
    assert SATURATED_TOO_LONG * experiment().controller.rate_hz == RUN
    limit, v = experiment().plant.drives.current_limit, np.full((1000, 6), 3.0)
    v[300 : 300 + RUN - 1, 2] = limit[2]
    v[600 : 600 + RUN - 1, 2] = -limit[2]  # short bursts do not add up, nor do those of other joints
    v[399 : 399 + RUN - 1, 4] = limit[4]
    assert fault_of(model, v) is None
    v[600 + RUN - 1, 2] = -limit[2]
    found = fault_of(model, v)
    assert found.kind == SATURATED
    assert "drive of joint3 at its limit of 240 for more than 0.1 s from t = 0.600 s" in str(found)
    v[200:350, 1], v[700:900, 3] = limit[1], -limit[3]
    assert "drive of joint2 at its limit of 480 for more than 0.1 s from t = 0.200 s" in str(fault_of(model, v))


def test_the_first_joint_that_leaves_its_range_is_named_with_time_and_range(model):
    v, q = np.full((1000, 6), 3.0), np.tile(STILL, (1000, 1))
    endless = copy(model)
    endless.jnt_range[3] = 0.0  # none, so that any position is in it
    assert fault_of(endless, v, q) is None
    low, high = model.jnt_range[4]
    q[350:, 4], q[700:, 0] = high + 0.02, model.jnt_range[0][0] - 0.1
    found = fault_of(endless, v, q)
    assert found.kind == LIMIT_REACHED
    assert f"joint5 at {high + 0.02:.3f} rad leaves its range {low:.3f} to {high:.3f} rad at t = 0.350 s" in str(found)


def test_an_experiment_that_nobody_can_wait_for_is_refused_at_once():
    long = {"trajectory": short_motion(duration=400.0), "controller": ControllerOptions(rate_hz=1e5), "step": 1e-5}
    for changes, message in (
        ({"step": 1e-12}, r"2 s in steps of 1e-12 s are 2e\+12 steps; 5e\+07 at most"),
        ({"step": 0.0}, r"step = 0 s: expected a positive number"),
        ({"step": 1.0}, r"step 1 s does not divide the control period 0\.001 s"),
        (long, r"400 s at 100000 Hz are 4e\+07 samples of 6 joints; 5e\+07 numbers at most"),
    ):
        started = time.process_time()
        (outcome,) = try_record([experiment(**changes)], streams(0), threads=1)
        with pytest.raises(PlantError, match=message):
            raise outcome
        assert time.process_time() - started < 1.0


def test_absurd_numbers_and_bodies_are_refused():
    for make, changes in (
        (nominal_plant, {"gain": np.full(6, 1e308)}),
        (partial(replace, CYLINDER), {"mass": 0.0}),
        (partial(replace, CYLINDER), {"com": (0.0, np.nan, 0.1)}),
        (partial(replace, CYLINDER), {"inertia": (1e9, 1e9, 1e9, 0.0, 0.0, 0.0)}),
    ):
        refused(PlantError, r"\A[^\n]{1,400}\Z", make, **changes)
    # More about z than about x and y together, which MuJoCo refuses.
    impossible = nominal_plant(replace(CYLINDER, inertia=(0.01, 0.01, 0.05, 0.0, 0.0, 0.0)))
    (outcome,) = try_record([experiment(plant=impossible, loaded=True)], streams(0), threads=1)
    with pytest.raises(PlantError, match=r"rx90\.xml with a payload of 7\.025 kg: "):
        raise outcome


def test_a_simulation_that_diverges_says_so_and_mujoco_says_nothing(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    wild = experiment(plant=nominal_plant(gain=-1e6 * np.ones(6), current_limit=np.full(6, 1e9)), trajectory=BRIEF)
    for threads in (1, 2):
        outcomes = try_record([wild, experiment(trajectory=BRIEF)], streams(0, 1), threads=threads)
        assert str(outcomes[0]).startswith("motion: the simulation diverged")
        assert not isinstance(outcomes[1], SimulationError)
    assert not list(tmp_path.iterdir())
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


HOME = np.array([[0.2, 0.3, 1.0, 0.1, 0.4, -0.2]])
HOLDING = FourierTrajectory(HOME[0], np.zeros((6, 2)), np.zeros((6, 2)), 0.5)
SOFT = ModelErrors(joint_compliance=(1e-5,) * 6, backlash=0.01)


def held(loaded: bool) -> np.ndarray:
    """Currents that hold the arm where it is [drive units], shape (6,): gravity, by MuJoCo, over the gain."""
    plant = nominal_plant()
    robot, drives = plant.robot, plant.drives
    model = bare_arm(robot.model, drives.rotor_inertia, robot.flange, plant.payload if loaded else None)
    torque = inverse_dynamics(model, HOME, np.zeros((1, 6)), np.zeros((1, 6)))[0]
    return drives.amplifier_offset + (torque + drives.coulomb_asymmetry) / drives.gain


@pytest.mark.parametrize(("loaded", "errors"), [(False, None), (True, SOFT)])
def test_a_drive_may_need_less_than_its_largest_current_and_no_more(loaded, errors):
    need, limit = np.abs(held(loaded)), nominal_plant().drives.current_limit.copy()
    for share in (1.001, 0.999):
        limit[1] = share * need[1]
        e = experiment(plant=nominal_plant(current_limit=limit, errors=errors), trajectory=HOLDING, loaded=loaded)
        if share > 1.0:
            check_torque_limits([e])
    advice = "use a lighter payload or a slower motion" if loaded else "motion: drive.*; use a slower motion"
    said = rf"drive of joint2 would need up to {need[1]:.4g}, its limit is {limit[1]:g}, for more than 0\.1 s from"
    refused(TrajectoryError, rf"(?=.*{said}).*{advice}", check_torque_limits, [e])
