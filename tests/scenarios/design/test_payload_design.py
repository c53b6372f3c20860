import json
import re
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from printed import printed

import scenarios.design.payload_design as module
from ident.payload.files import payload_to_table, read_payload
from ident.payload.payload import Payload
from scenarios.cli import main
from scenarios.design.excitation import Design, design_problem, objective
from scenarios.design.payload_design import IMPOSSIBLE, Carrying, PayloadDesign, design_payload
from scenarios.design.payload_folder import as_written, write_payload_folder, write_scenario_file
from scenarios.design.weights import Weight
from scenarios.experiments.build import Setup, body_of, setup_of, setup_without_motion
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.motions import read_motion
from scenarios.prediction.deviations import Deviations
from scenarios.reports.payload import payload_design_result, payload_report
from scenarios.reports.payload_drawing import draw_weight
from scenarios.support.errors import ScenarioError
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.flange import flange_of
from sim.trajectory import at_rest

BAR = Weight(shape="bar", dimensions=(53.0, 212.0, 116.0), quarter=0, density=7850.0)
"""What `rx90 payload nominal` finds."""
WIDE = Weight(shape="plate", dimensions=(600.0, 300.0, 5.0, 268.0), quarter=2, density=600.0)


@pytest.fixture(scope="module")
def nominal() -> Setup:
    return setup_of(load_scenario("nominal"))


@pytest.fixture(scope="module")
def carrying(nominal) -> Carrying:
    problem = replace(design_problem(setup_without_motion(nominal.scenario)), joints=np.arange(6))
    motion = nominal.experiments[0].trajectory
    return Carrying(
        design=Design(problem),
        motion=motion,
        flange=flange_of(problem.plant.robot),
        known="all",
        most=6.0,
        density=7850.0,
    )


@pytest.fixture(scope="module")
def designed(nominal) -> PayloadDesign:
    """By a search much shorter than usual."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "POPULATION", 3)
        patch.setattr(module, "GENERATIONS", 3)
        return design_payload(nominal, density=7850.0, seed=1, tell=lambda done, what: None)


def test_the_predicted_deviations_are_those_of_the_problem_with_that_weight_on_the_flange(carrying):
    found = carrying.candidate(BAR)
    design = Design(carrying.problem_with(BAR, found.payload))
    expected = design.deviations(design.rows(carrying.motion))
    np.testing.assert_allclose(found.deviations.noise, expected.noise, rtol=1e-12)
    np.testing.assert_allclose(found.deviations.payload, expected.payload, rtol=1e-12)
    assert found.refusal == ""
    assert (found.deviations.total < 0.0055).all()
    y = design.rows(carrying.motion).torques(design.problem.carried.chi)
    np.testing.assert_allclose(found.torque, np.sqrt(((y[1] - y[0]) ** 2).mean(axis=0)), rtol=1e-9)  # a difference


@pytest.mark.parametrize(
    ("weight", "most", "limit", "why"),
    [
        (BAR, 5.9, 1.0, r"weighs 5\.97 kg, more than the robot's rated load of 5\.9 kg"),
        (BAR, 6.0, 0.5, r"needs 1\d\d % of a drive's torque, where 83 % may be used"),
        (replace(BAR, dimensions=(30.0, 40.0, 250.0)), 6.0, 1.0, ""),
        (WIDE, 6.0, 1.0, "floor or arm"),
    ],
    ids=["heavy", "weak drives", "light", "wide"],
)
def test_a_weight_that_must_not_be_mounted_costs_more_than_any_other_and_says_why(carrying, weight, most, limit, why):
    problem = carrying.design.problem
    weak = replace(problem, limits=replace(problem.limits, torque=limit * problem.limits.torque))
    design = Design(weak)
    judged = replace(carrying, most=most, design=design)
    found = judged.candidate(weight)
    if not why:
        assert found.refusal == ""
        assert judged.cost(weight) < 0.0
        return
    assert re.search(why, found.refusal)
    assert judged.cost(weight) > (judged.candidate(BAR).cost if why == "floor or arm" else IMPOSSIBLE - 1e-9)


def test_a_weight_that_misses_the_flange_costs_more_the_farther(carrying):
    near, far = (
        carrying.cost(Weight(shape="cylinder", dimensions=(100.0, 40.0, offset), quarter=0, density=7850.0))
        for offset in (25.0, 60.0)
    )
    assert IMPOSSIBLE < near < far


def test_a_designed_weight_shows_the_joint_that_the_paper_s_cannot_and_is_within_the_limits(designed):
    before, after = designed.shows(designed.before.deviations), designed.shows(designed.after.deviations)
    assert before.tolist() == [True] * 5 + [False]
    assert after.all()
    assert designed.carrying.most == 6.0
    assert designed.best.payload.mass <= 6.0
    assert designed.best.refusal == ""
    assert [each.weight.shape for each in designed.candidates] == [
        each.weight.shape for each in sorted(designed.candidates, key=lambda each: (bool(each.refusal), each.cost))
    ]
    assert {each.weight.shape for each in designed.candidates} == {"bar", "cylinder", "plate"}


def test_a_design_in_which_nothing_may_be_mounted_is_refused(designed):
    refused = tuple(replace(each, refusal="weighs 9 kg") for each in designed.candidates)
    with pytest.raises(ScenarioError, match=r"nominal: no payload meets the limits: the best \w+ weighs 9 kg"):
        _ = replace(designed, candidates=refused).best


def test_a_scenario_that_carries_nothing_has_nothing_to_be_designed_for(tmp_path):
    path = tmp_path / "bare.toml"
    path.write_text('extends = "nominal"\n[experiment]\nprotocol = ["bare"]\n')
    with pytest.raises(ScenarioError, match="mounts no payload"):
        design_problem(setup_without_motion(load_scenario(str(path))))


def test_the_report_says_why_joint_6_stayed_unseen_and_what_changes_it(designed):
    report = payload_report(designed, None)
    words = " ".join(part.text for part in report.parts if hasattr(part, "text"))
    assert "Joint 6: the scenario's payload contributes 0.13 of 12.7 N m rms (centre of mass 0.0 mm off" in words
    assert "identifies every joint" in words
    found = json.loads(json.dumps(report.document))
    assert [joint["shown"] for joint in found["before"]["joints"]] == [True] * 5 + [False]
    assert [joint["shown"] for joint in found["after"]["joints"]] == [True] * 6
    assert found["candidates"][0]["refusal"] is None
    assert found["rated_load"] == 6.0


@pytest.mark.parametrize(("most", "warned"), [(np.inf, True), (6.0, False)])
def test_a_payload_for_an_arm_without_rated_load_comes_with_a_warning_and_with_the_next_command(
    designed, tmp_path, most, warned
):
    carrying = replace(designed.carrying, most=most)
    report = payload_report(replace(designed, carrying=carrying), tmp_path / "a b")
    words = [part.text for part in report.parts if hasattr(part, "text")]
    assert ["state it as rated_load in robot.toml" in each for each in words].count(True) == warned
    assert f"rx90 run '{tmp_path}/a b/scenario.toml'" in words


def test_a_deviation_of_a_joint_that_nothing_is_seen_of_is_null(designed):
    noise, payload = np.array([0.3, np.inf, 1.0, 0.2, 0.5, 0.8]), np.array([0.1, 0.2, np.inf, 0.4, 0.5, 0.6])
    before = replace(designed.before, deviations=Deviations(noise=noise, payload=payload))
    joints = payload_design_result(replace(designed, before=before)).before.joints
    assert [each.std for each in joints] == [0.3, None, 1.0, 0.2, 0.5, 0.8]
    assert [each.payload_std for each in joints] == [0.1, 0.2, None, 0.4, 0.5, 0.6]


@pytest.mark.parametrize(("factor", "better"), [(0.9999, True), (1.0001, False)])
def test_a_scenario_s_own_payload_that_shows_the_worst_joint_better_is_said_to_be_kept(designed, factor, better):
    worst = factor * designed.after.deviations.noise.max()
    noise = np.array([0.3, 0.9, 1.0, 0.2, 0.5, 0.8]) * worst
    before = Deviations(noise=noise, payload=np.full(6, 7.0))  # what is known of either payload does not count
    report = payload_report(replace(designed, before=replace(designed.before, deviations=before)), None)
    words = f"own payload already identifies the worst joint better: {100.0 * worst:.2f} % against"
    told = [part for part in report.parts if words in getattr(part, "text", "")]
    assert [part.strong for part in told] == [True] * better
    assert report.document["own_is_better"] is better


def test_the_best_weight_along_another_motion_puts_the_torque_there_that_mujoco_says(designed):
    rng = np.random.default_rng(5)
    motion = at_rest(np.array([0.2, 0.1, 1.0, 0.1, 0.4, -0.2]), *(0.1 * rng.normal(size=(2, 6, 3))), 7.0)
    best, robot = designed.best, designed.carrying.design.problem.plant.robot
    design = Design(designed.carrying.problem_with(best.weight, best.payload))
    again = replace(designed.carrying, motion=motion).candidate(best.weight)
    rows = design.rows(motion)
    carrying, bare = (
        inverse_dynamics(bare_arm(robot.model, np.zeros(6), robot.flange, body), *rows.motion)
        for body in (body_of(best.payload), None)
    )
    rms = np.sqrt(np.mean((carrying - bare) ** 2, axis=0))
    np.testing.assert_allclose(again.torque, rms, rtol=1e-9)  # rounding
    assert np.abs(again.torque / best.torque - 1.0).min() > 0.01
    expected = design.deviations(rows)
    np.testing.assert_allclose(again.deviations.total, expected.total, rtol=1e-12)
    np.testing.assert_allclose(again.cost, objective(expected.total), rtol=1e-12)
    assert (again.weight, again.payload) == (best.weight, best.payload)


def test_with_a_motion_searched_for_it_all_numbers_of_the_new_weight_are_of_that_motion(
    designed, nominal, tmp_path, capsys, monkeypatch
):
    import scenarios.commands.payload as command
    import scenarios.design.payload_design as package

    def found(design, series, options, before):
        slow = replace(nominal.experiments[0].trajectory, duration=series.duration)
        return SimpleNamespace(interrupt=None, kept=(SimpleNamespace(x=series.point(slow)),))

    monkeypatch.setattr(package, "design_payload", lambda *_, **__: designed)
    monkeypatch.setattr(command, "PROCESSES", SimpleNamespace(prepare=lambda: None))
    monkeypatch.setattr(command, "searched", found)
    harmonics = str(nominal.experiments[0].trajectory.sine.shape[1])
    words = ["payload", "nominal", "--excite", "--harmonics", harmonics, "--duration", "31"]
    main([*words, "--out", str(tmp_path / "new"), "--json"])
    told = json.loads(capsys.readouterr().out)
    again = replace(designed.carrying, motion=read_motion("motion.toml", tmp_path / "new"))
    again = again.candidate(designed.best.weight)
    for after, candidate in ((told["after"], again), (told["candidates"][0], designed.best)):
        torque = [joint["payload_torque_rms"] for joint in after["joints"]]
        np.testing.assert_allclose(torque, candidate.torque, rtol=1e-6)  # digits of the motion's file
        deviations = [joint["std"] for joint in after["joints"]]
        # The same digits decide which samples at a reversal count.
        np.testing.assert_allclose(deviations, candidate.deviations.noise, rtol=1e-3)
    assert np.abs(again.deviations.noise / designed.best.deviations.noise - 1.0).max() > 0.01
    text = (tmp_path / "new/payload.md").read_text()
    assert f"the new one contributes {again.torque[5]:.2g} N m." in text
    table = [line.split("|") for line in text.splitlines() if line.startswith("|")]
    row = next(line for line in table if line[1].strip() == "6")
    assert [row[4].strip(), row[5].strip()] == [f"{again.torque[5]:.3g}", f"{100.0 * again.deviations.noise[5]:.2f}"]


def test_a_scenario_with_an_odd_name_can_be_extended(designed, tmp_path):
    write_scenario_file(designed, str(tmp_path / "od\td\x7f.toml"), tmp_path / "scenario.toml")
    assert tomllib.loads((tmp_path / "scenario.toml").read_text())["extends"] == "od\td\x7f.toml"


@pytest.mark.parametrize(
    ("weight", "numbers"),
    [
        (BAR, {"53", "212", "116", "15", "63", "174"}),
        (Weight(shape="cylinder", dimensions=(160.0, 40.0, 45.0), quarter=1, density=7850.0), {"160", "40", "45"}),
        (
            Weight(shape="plate", dimensions=(220.0, 100.0, 30.0, 70.0), quarter=2, density=7850.0),
            {"220", "100", "30", "70"},
        ),
    ],
    ids=["bar", "cylinder", "plate"],
)
def test_a_drawing_has_every_dimension_and_the_mass(weight, numbers):
    figure = draw_weight(weight, flange="tool7")
    written = {text.get_text().replace("\u2300 ", "") for axes in figure.axes for text in axes.texts}
    assert numbers <= written
    assert "kg at 7850 kg/m" in figure.get_suptitle()
    assert "in the axes of the flange, 'tool7' of the model: x" in figure.get_suptitle()
    assert (
        "in the axes of the flange, at the last joint, z along its axis: x"
        in draw_weight(weight, flange="").get_suptitle()
    )


@pytest.mark.parametrize("quarter", range(4))
def test_both_views_show_the_centre_of_mass_on_the_side_of_each_axis_of_the_flange_that_the_title_states(quarter):
    weight = replace(BAR, quarter=quarter)
    figure, com = draw_weight(weight, flange=""), dict(zip("xyz", weight.turned @ weight.properties.com, strict=True))
    for view in figure.axes:
        mark = np.array([view.lines[-1].get_xdata(), view.lines[-1].get_ydata()]).ravel()
        ends = {text.get_text(): np.array(text.get_position()) for text in view.texts if text.get_text() in com}
        assert len(ends) == 2
        for name, end in ends.items():
            # Positions are in mm, and the mark is drawn at the centre of mass.
            np.testing.assert_allclose(mark @ end / np.linalg.norm(end), 1e3 * com[name], atol=1e-9)


def test_a_payload_is_written_with_six_digits_and_zeros_where_there_is_nothing():
    inertia = (0.0123456789, 0.0234567891, 0.0298765432, -4.66e-18, 5.77350269e-05, -2.5e-11)
    std = (1e-5, 2e-5, 3e-5, 4.5678949e-7, 1.2e-13, 2.1e-14)
    given = Payload(
        mass=3.14159265, mass_std=0.00123456789, com=(-0.456, 3.4e-18, -0.123456789),
        com_std=(5.77350269e-05, 2e-5, 3e-5), inertia=inertia, inertia_std=std, known="com",
    )  # fmt: skip
    expected = Payload(
        mass=3.14159, mass_std=0.00123457, com=(-0.456, 0.0, -0.123457), com_std=(5.7735e-05, 2e-5, 3e-5),
        inertia=(0.0123457, 0.0234568, 0.0298765, 0.0, 5.7735e-05, 0.0),
        inertia_std=(1e-5, 2e-5, 3e-5, 4.56789e-7, 1.2e-13, 0.0), known="com",
    )  # fmt: skip
    assert as_written(given) == expected
    assert "-0.0," not in repr(as_written(given))


def test_a_scenario_mounts_the_payload_of_its_file(designed, tmp_path):
    write_payload_folder(designed, "nominal", None, tmp_path)
    mounted = tomllib.loads((tmp_path / "scenario.toml").read_text())["belief"]["payload"]
    assert mounted == payload_to_table(read_payload(tmp_path / "payload.toml"))
    assert "# com: m from joint6, the last joint" in (tmp_path / "payload.toml").read_text()


def test_the_designed_payload_gives_all_six_gains(designed, tmp_path):
    # Seed 0; the deviations are a quarter of the tolerance of 1 %.
    write_payload_folder(designed, "nominal", None, tmp_path)
    table = tomllib.loads((tmp_path / "scenario.toml").read_text())
    assert table["tolerance"]["identifiable"] == [True] * 6
    assert read_payload(tmp_path / "payload.toml") == as_written(designed.best.payload)
    assert main(["run", str(tmp_path / "scenario.toml")]) == 0


def test_the_command_writes_drawing_payload_and_scenario(designed, tmp_path, capsys, monkeypatch):
    import scenarios.design.payload_design as design

    monkeypatch.setattr(design, "design_payload", lambda *_, **__: designed)
    assert main(["payload", "nominal", "--out", str(tmp_path / "new"), "--json"]) == 0
    assert printed(capsys, "payload-design")["scenario"] == "nominal"
    names = {"payload.toml", "scenario.toml", "payload.md", "payload-drawing.png", "payload-drawing.svg"}
    assert {path.name for path in (tmp_path / "new").iterdir()} == {*names, ".rx90.json"}
    unseen = replace(designed, shown_below=1e-5)
    monkeypatch.setattr(design, "design_payload", lambda *_, **__: unseen)
    assert main(["payload", "nominal"]) == 1
    assert "No payload within the limits identifies joint 1, 2, 3, 4, 5, 6." in capsys.readouterr().out
