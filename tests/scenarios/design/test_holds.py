import pickle
from dataclasses import replace

import numpy as np
import pytest
from invented_arm import invented_problem

import scenarios.design.search as searching
from scenarios.cli import main
from scenarios.design.excitation import Design, worst_of
from scenarios.design.holds import LEGS, Holds, hold_problem
from scenarios.experiments.motions import read_motion
from scenarios.experiments.run import run
from scenarios.experiments.scenario import changed, load_scenario, setup_of
from scenarios.support.errors import ScenarioError
from sim.feedforward_currents import feedforward_currents


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    return invented_problem(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def holds(problem):
    return Holds(limits=problem.limits, duration=72.0)


def test_a_point_s_motion_rests_at_its_poses_and_between_and_comes_back_the_same_way(holds):
    x = np.random.default_rng(2).uniform(-0.8, 0.8, (LEGS + 1) * holds.n)
    motion, limits = holds.motion(x), holds.limits
    poses = 0.5 * (limits.upper + limits.lower) + 0.5 * (limits.upper - limits.lower) * x.reshape(LEGS + 1, -1)
    there = np.stack(
        [np.interp(np.arange(0.0, LEGS + 0.5, 0.5), np.arange(LEGS + 1), each) for each in poses.T], axis=1
    )
    q, dq, _ = motion(np.linspace(0.0, 72.0, 4 * LEGS + 1))  # the middle of each hold
    size = np.abs(np.diff(poses, axis=0)).max()
    np.testing.assert_allclose(q, np.concatenate((there, there[-2::-1])), rtol=0, atol=2e-3 * size)  # smoothed kinks
    fastest = np.abs(motion(np.arange(0.0, 72.0, 0.02))[1]).max()
    assert np.abs(dq).max() < 0.03 * fastest
    t = np.linspace(0.0, 36.0, 50)
    np.testing.assert_allclose(motion(t)[0], motion(72.0 - t)[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(holds.point(motion), x, rtol=0, atol=1e-6)  # the condition to be at rest


def test_a_problem_of_holds_is_slow_and_wants_what_gravity_loads_and_a_joint_at_rest_shows_nothing(problem, holds):
    held, unloaded = hold_problem(problem)
    assert not np.intersect1d(held.joints, np.flatnonzero(unloaded)).size
    assert (held.limits.velocity <= 0.5 / 0.95 + 1e-12).all()
    design = Design(pickle.loads(pickle.dumps(held)))
    x = np.tile(np.zeros(holds.n), LEGS + 1)
    still = holds.motion(x)
    assert (design.deviations(design.rows(still)).total[held.joints] > 0.9).all()  # what is known beforehand: 1
    x = np.random.default_rng(1).uniform(-0.7, 0.7, x.size)
    assert (design.deviations(design.rows(holds.motion(x))).total[held.joints] < 0.1).any()
    none = replace(problem, joints=np.flatnonzero(unloaded))
    with pytest.raises(ScenarioError, match="puts no torque on any joint to identify"):
        hold_problem(none)


def test_holds_may_take_less_of_a_torque_than_other_motions(problem):
    held, n = hold_problem(problem)[0].limits, 3
    middle = (np.tile(0.5 * (held.upper + held.lower), (5, 1)), np.zeros((5, n)), np.zeros((5, n)))
    torques = np.zeros((2, 5, n))
    torques[1, 3, 2] = -0.77 * held.torque[2]
    assert not problem.limits.excess(middle, torques).any()
    over = held.excess(middle, torques)
    np.testing.assert_allclose(over[3, 3, 2], 0.07, rtol=1e-9)
    assert np.count_nonzero(over) == 1
    used = "takes 77 % of the torque of joint wrist, where 70 % may be used"
    assert worst_of(over, ("base", "slide", "wrist"), held.shares) == used


@pytest.mark.parametrize(("direction", "offset"), [(-0.3, 0.2), (0.3, -0.2)])
def test_drives_bear_the_built_in_holds_with_the_weakest_gains_and_most_friction_that_are_drawn(direction, offset):
    setup = setup_of(load_scenario("holds"))
    drawn = {
        "plant.gain": (0.85 * setup.true_gain).tolist(),
        "plant.amplifier_offset": [offset] * 6,
        "plant.payload.mass": 8.04,
        "plant.errors.load_friction": 0.1,
        "plant.errors.stribeck": 0.2,
        "plant.errors.coulomb_by_direction": direction,
    }
    experiments = changed(setup, drawn).experiments
    for experiment, v in zip(experiments, feedforward_currents(experiments, 100.0), strict=True):
        assert (np.abs(v) < experiment.plant.drives.current_limit).all()


def test_the_command_writes_a_motion_file_of_holds(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(searching, "FIRST", 8)
    out = tmp_path / "motion.toml"
    words = ["excite", "ur10e", "--protocol", "holds", "--evaluations", "1", "--jobs", "1", "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr()
    assert "puts no torque on joint 1: holds" in said.err
    assert "of the gains, from noise of the currents alone [%]: -, " in " ".join(said.out.split())
    assert "excite ur10e --protocol holds --seed 0 --duration 72 --evaluations 1 --out FILE" in out.read_text()
    assert read_motion(out.name, tmp_path).duration == 72.0
    for more in ("--harmonics=9", "--improve"):
        assert main([*words, more, "--force"]) == 2
        assert "cannot be combined with --protocol holds" in capsys.readouterr().err


@pytest.mark.slow
def test_holds_at_30_hz_give_the_gains_that_gravity_loads_within_their_tolerances():
    done = run(setup_of(load_scenario("holds")), 3)
    gains = done.verdict.gains
    assert done.passed
    assert [gain.identifiable for gain in gains] == [False, True, True, True, True, True]
    # Of 20 seeds 93 of 95 gains lay within two deviations; four of this fixed seed's are 1 in 16 000.
    assert all(abs(gain.z) < 4.0 for gain in gains[1:])
    np.testing.assert_allclose(1.0 / done.recordings[0].period, 30.0, rtol=1e-9)
