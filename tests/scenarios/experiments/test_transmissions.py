"""A robot whose motors turn with several joints, from its file to gains, predictions, folders and commands."""

from dataclasses import replace

import numpy as np
import pytest
from plants import RX90, short_motion

import rx90_mjcf
import scenarios
from ident.estimation.problem import GainOptions
from ident.model.arm import load_arm, load_joints, stated_transmission
from ident.model.structure import structure_of
from ident.observation.observation import ObserveOptions
from ident.support.errors import GainsError, RobotModelError
from scenarios.cli import main
from scenarios.design.excitation import CLEARANCE, SHARES, Design
from scenarios.design.new_robot import bar, new_robot
from scenarios.design.record import sampled
from scenarios.experiments.motions import write_motion
from scenarios.experiments.robots import read_arm, structure
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.experiments.schema import body_of
from scenarios.gains_in_use.patch import joint_values
from scenarios.prediction.deviations import ArmModel
from scenarios.prediction.predictor import expected_logs
from scenarios.results.gains_file import check_units, gains_file
from scenarios.results.problem_folder import GivenProblem, read_problem, write_problem
from scenarios.support.errors import ScenarioError
from sim.controller import inverse_dynamics
from sim.feedforward_currents import feedforward_currents
from sim.plant import bare_arm
from sim.robot import read_robot

A = np.eye(6)
A[2, 1], A[4:, 4:] = 1.0, ((0.7, 0.4), (0.6, -0.9))
"""The elbow turns against the base, the wrist is a differential of unequal gears."""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    folder = tmp_path_factory.mktemp("turned")
    text = rx90_mjcf.ROBOT.read_text(encoding="utf-8")
    text = text[: text.index("[[coupling]]")] + text[text.index("[frames]") :]
    stated = f'model = "{RX90.model}"\ntransmission = {A.tolist()}'
    (folder / "robot.toml").write_text(text.replace('model = "rx90.xml"', stated), encoding="utf-8")
    write_motion(short_motion(8.0, 0.25), folder / "motion.toml", [])
    path = folder / "scenario.toml"
    path.write_text(
        'extends = "nominal"\nrobot = "robot.toml"\nexperiment.motion = "motion.toml"\nexperiment.step = 0.002\n'
        "experiment.controller.rate_hz = 500.0\n"
    )
    return str(path)


def test_gains_of_motors_are_found_and_belong_to_that_transmission(scenario, tmp_path):
    loaded = scenarios.load(scenario)
    logs = loaded.simulate(seed=4).logs
    found = loaded.run(seed=4).identification.estimate
    error = (found.gain - RX90.drives.gain) / found.std
    assert found.identifiable[1:].all()  # a differential wrist shows the payload on both of its motors
    assert np.abs(error).max() < 3.0
    given = {"observing": ObserveOptions(), "gains": GainOptions()}
    origin = GivenProblem(model=RX90.model, arm=loaded.arm, motions=tuple(logs), **given)
    file = gains_file(found, origin)
    assert file.transmission == tuple(map(tuple, A.tolist()))
    file.of(loaded.arm)
    with pytest.raises(GainsError, match="transmission"):
        file.of(load_arm(RX90.model))
    own = file.model_copy(update={"transmission": None})
    with pytest.raises(GainsError, match="several"):
        own.of(loaded.arm)
    with pytest.raises(ScenarioError, match="different transmissions"):
        check_units(file, own)
    with pytest.raises(GainsError, match="nothing is written"):
        joint_values(structure_of(load_arm(RX90.model)), file, None, None, most=0.1)
    write_problem(tmp_path / "problem", origin)
    np.testing.assert_array_equal(read_problem(tmp_path / "problem").arm.transmission, A)


def test_predicted_currents_motions_and_limits_are_those_of_the_motors(scenario):
    setup = setup_of(load_scenario(scenario))
    bare, rate = setup.experiments[0], 25.0
    (v,) = feedforward_currents([bare], rate)  # by MuJoCo
    motion = bare.trajectory(np.arange(len(v)) / rate)
    rows = ArmModel.of(setup.plant, setup.structure).rows(motion, rate)  # by identification's own model
    np.testing.assert_allclose(rows.bare / setup.plant.drives.gain, v, rtol=0, atol=1e-3 * np.abs(v).max())
    commanded = sampled(setup, rate)
    for own, given in zip(commanded[1:], motion, strict=True):
        np.testing.assert_allclose(own, given @ A.T, rtol=0, atol=1e-12)
    expected = expected_logs(setup, 20)[0].log  # without noise of the encoders, but with their quantum
    turned = bare.trajectory(expected.t)[0] @ A.T
    np.testing.assert_allclose(expected.q, turned, rtol=0, atol=setup.experiments[0].sensors.encoder_quantum)
    design = Design.of(setup)
    whole = design.limits
    tight = replace(whole, lower=0.1 * whole.lower, upper=0.2 * whole.upper, velocity=0.1 * whole.velocity)
    over = replace(design, limits=tight).excess(rows)[:12].reshape(2, 6, -1)
    used = np.abs(motion[0] - tight.center) / tight.half, np.abs(commanded.dq) / tight.velocity
    shares = np.array((SHARES["range"], SHARES["speed"]))[:, None, None]
    beyond = np.maximum(np.swapaxes(used, 1, 2) - shares, 0.0)
    assert (beyond.max(axis=(1, 2)) > 0.0).all()
    np.testing.assert_allclose(over, beyond, rtol=0, atol=1e-9)
    distance = design.clearance(motion[0])
    shortfall = np.maximum(1.0 - distance / CLEARANCE, 0.0)
    np.testing.assert_allclose(design.excess(rows)[-1], shortfall, rtol=0, atol=1e-9)


TENDONS = """<mujoco model="wrist"><compiler angle="radian"/><worldbody><body name="post" pos="0 0 0.6">
<joint name="lift" axis="0 1 0" range="-1.3 1.3"/><inertial pos="0.2 0 0" mass="4" diaginertia="0.02 0.05 0.05"/>
<body name="cross" pos="0.45 0 0"><joint name="pitch" axis="0 1 0" range="-1.4 1.4"/>
<inertial pos="0.03 0 0" mass="0.9" diaginertia="0.001 0.001 0.001"/>
<body name="hand" pos="0.02 0 0"><joint name="roll" axis="1 0 0" range="-2.5 2.5"/>
<inertial pos="0.06 0.01 0" mass="0.6" diaginertia="0.0006 0.001 0.001"/></body></body></body></worldbody>
<tendon><fixed name="mB"><joint joint="pitch" coef="1.5"/><joint joint="roll" coef="-2"/></fixed>
<fixed name="mA"><joint joint="pitch" coef="1"/><joint joint="roll" coef="3"/></fixed></tendon>
<actuator><motor name="a1" joint="lift" forcerange="-80 80"/><motor name="aA" tendon="mA"/>
<motor name="aB" tendon="mB"/></actuator></mujoco>"""


def test_a_new_robot_takes_the_matrix_of_its_motors_from_the_tendons_of_its_file(tmp_path):
    (tmp_path / "wrist.xml").write_text(TENDONS)
    together = r"motor 'aA'.* moves joints pitch and roll together.*transmission"
    for reads in (load_arm, lambda path: read_arm(path, ())):
        with pytest.raises(RobotModelError, match=together):
            reads(tmp_path / "wrist.xml")
    new = new_robot(tmp_path / "wrist.xml")
    np.testing.assert_array_equal(new.transmission, [[1.0, 0.0, 0.0], [0.0, 1.0, 3.0], [0.0, 1.5, -2.0]])
    A = new.transmission
    assert new.drives["max_velocity"].value.tolist() == [2.0, 8.0, 7.0]  # 2 rad/s of each joint at once
    rng, speed = np.random.default_rng(3), np.array([2.0, 7.0 / 1.5, 8.0 / 3.0]) / 3.0  # of one joint alone
    states = [rng.uniform(low, high, (4000, 3)) for low, high in ((new.arm.lower, new.arm.upper), (-speed, speed))]
    states.append(4.0 * rng.uniform(-speed, speed, (4000, 3)))
    load = body_of(bar(new.arm, 0.1 * 5.5))  # a tenth of the links
    joints = inverse_dynamics(bare_arm(tmp_path / "wrist.xml", np.zeros(3), None, load), *states)
    share = 2.0 * np.abs(np.linalg.solve(A.T, joints.T)).max(axis=1) / new.drives["current_limit"].value
    assert ((share[1:] > 0.98) & (share[1:] < 1.25)).all()  # 200 states see somewhat less than 4000; 80 N m are stated
    (tmp_path / "robot").mkdir()
    new.write(tmp_path / "robot", "../wrist.xml", [0.01] * 3)
    robot = read_robot(tmp_path / "robot/robot.toml")
    np.testing.assert_array_equal(robot.motors, new.transmission)
    assert "joint_compliance" not in (tmp_path / "robot/scenario.toml").read_text()
    np.testing.assert_array_equal(structure(robot, ()).arm.transmission, new.transmission)
    with pytest.raises(RobotModelError, match=together):
        structure(robot.model_copy(update={"transmission": None}), ())


def test_a_tendon_takes_the_row_of_a_joint_that_has_no_motor_of_its_own(tmp_path):
    for motors, rows in (
        ('<motor joint="pitch"/><position tendon="mB"/><velocity tendon="mB"/>', [[1.0, 0.0], [1.5, -2.0]]),
        ('<motor tendon="mB"/><motor joint="roll"/>', [[1.5, -2.0], [0.0, 1.0]]),
        ('<motor tendon="mB"/><motor tendon="mA"/>', [[1.5, -2.0], [1.0, 3.0]]),  # without names on one line
        ('<motor tendon="mB"/><motor joint="roll"/><motor joint="pitch"/>', None),
    ):
        start = TENDONS.index('<motor name="aA"')
        (tmp_path / "wrist.xml").write_text(TENDONS[:start] + motors + "</actuator></mujoco>")
        arm, minimal = load_joints(tmp_path / "wrist.xml")
        found = stated_transmission(minimal, arm.joint_names)
        assert rows is None if found is None else found[1:, 1:].tolist() == rows


def test_commands_for_such_a_robot_name_its_file_and_pages_say_what_turns(scenario, tmp_path, capsys):
    assert main(["record", scenario, "--out", str(tmp_path)]) == 0
    page = (tmp_path / "record.md").read_text(encoding="utf-8")
    commands = [line for line in page.splitlines() if line.startswith("    rx90 ") and ".parquet" in line]
    robot = str(load_scenario(scenario).folder / "robot.toml")
    assert [robot in line for line in commands] == [False, True, True, True]  # convert needs none
    assert f"q_motor = A q, A = {A.tolist()}" in page
    assert "positions of the motors" in page
    assert f"A = {A.tolist()}" in " ".join(capsys.readouterr().out.split())
