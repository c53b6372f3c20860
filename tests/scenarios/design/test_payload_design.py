import re
from copy import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from printed import printed

import scenarios.design.payload_design as module
from ident.payload.payload import payload_to_table, read_payload
from scenarios.cli import main
from scenarios.design.excitation import Design, objective
from scenarios.design.payload_design import IMPOSSIBLE, PayloadDesign, PayloadSearch, Weight, design_payload, payload_of
from scenarios.experiments.scenario import Setup, load_scenario, setup_of, setup_without_motion, with_settings
from scenarios.prediction.deviations import Carried
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import toml_value
from sim.shapes import Flange, add_solid

STEEL = 7850.0
SEARCH = {"density": STEEL, "seed": 1, "tell": lambda done, what: None}
FOUND = Weight(shape="bar", dimensions=(53.0, 212.0, 116.0), quarter=0, density=STEEL)
"""What `rx90 payload nominal` finds."""
FAR = Weight(shape="plate", dimensions=(600.0, 300.0, 5.0, 268.0), quarter=2, density=600.0)
BAR = Weight(shape="bar", dimensions=(47.0, 133.0, 91.0), quarter=3, density=STEEL)
WIDE = Weight(shape="bar", dimensions=(83.0, 61.0, 45.0), quarter=0, density=2700.0)
CYLINDER = Weight(shape="cylinder", dimensions=(171.0, 29.0, 53.0), quarter=1, density=STEEL)
PLATE = Weight(shape="plate", dimensions=(310.0, 87.0, 23.0, 77.0), quarter=2, density=8900.0)


@pytest.fixture(scope="module")
def nominal() -> Setup:
    return setup_of(load_scenario("nominal"))


@pytest.fixture(scope="module")
def payloads(nominal) -> PayloadSearch:
    return PayloadSearch(nominal, STEEL)


@pytest.fixture(scope="module")
def designed(nominal) -> PayloadDesign:
    """By a search much shorter than usual."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "POPULATION", 3)
        patch.setattr(module, "GENERATIONS", 2)
        return design_payload(nominal, **SEARCH)


def tilted() -> Flange:
    quat, R = np.array([0.7, -0.4, 0.5, 0.31]), np.empty(9)
    mujoco.mju_quat2Mat(R, quat / np.linalg.norm(quat))
    return Flange(origin=np.array([0.012, -0.034, 0.085]), rotation=R.reshape(3, 3), name="flange")


@pytest.mark.parametrize("weight", [BAR, WIDE, CYLINDER, PLATE], ids=["bar", "wide bar", "cylinder", "plate"])
def test_mass_centre_and_inertia_on_a_tilted_flange_are_those_of_the_shapes_in_mujoco(weight):
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="weight")
    for solid in weight.solids(tilted()):
        add_solid(body, solid)
    for geom in spec.geoms:
        geom.mass, geom.density = np.nan, weight.density
    model, R = spec.compile(), np.empty(9)
    mujoco.mju_quat2Mat(R, model.body_iquat[1])
    R = R.reshape(3, 3)
    payload = payload_of(weight, tilted())
    np.testing.assert_allclose(payload.mass, model.body_mass[1], rtol=1e-12)
    np.testing.assert_allclose(payload.com, model.body_ipos[1], rtol=0, atol=1e-12)
    ixx, iyy, izz, ixy, ixz, iyz = payload.inertia
    expected = R @ np.diag(model.body_inertia[1]) @ R.T  # principal axes by iterations, to 1e-8 or so
    np.testing.assert_allclose([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], expected, rtol=0, atol=1e-8)
    assert (payload.mass_std, payload.com_std, payload.known) == (0.025, (2e-4, 2e-4, 2e-4), "all")
    np.testing.assert_allclose(payload.inertia_std, 3e-3 * max(payload.inertia), rtol=1e-12)


def test_dimensions_are_those_that_their_names_state():
    upright = Flange(origin=np.zeros(3), rotation=np.eye(3), name="flange")
    for weight, center in ((CYLINDER, [0.0, 0.053, 0.0145]), (PLATE, [-0.077, 0.0, 0.0115])):  # one and two quarters
        np.testing.assert_allclose(weight.solids(upright)[0].center, center, rtol=0, atol=1e-15)
    # The bracket covers the flange's face, 63 mm, and ends with the bar.
    ends = (31.5 + 91.0 + 23.5, 63.0, 15.0), (0.5 * (91.0 + 23.5 - 31.5), 0.0, 7.5)
    np.testing.assert_array_equal(BAR.blocks, [ends, ((47.0, 47.0, 133.0), (91.0, 0.0, 15.0 + 66.5))])
    assert WIDE.blocks[0][0][1] == 83.0
    near = replace(BAR, dimensions=(20.0, 133.0, 5.0)).blocks[0]  # it covers the face on the bar's side too
    np.testing.assert_array_equal(near, [(63.0, 63.0, 15.0), (0.0, 0.0, 7.5)])
    for weight, last, missing in ((CYLINDER, 54.0, 0.0), (CYLINDER, 60.0, 6.0), (PLATE, 130.0, 6.5), (BAR, 249.0, 0.0)):
        assert replace(weight, dimensions=(*weight.dimensions[:-1], last)).uncovered == missing  # mm of the flange


def test_the_predicted_deviations_are_those_of_the_problem_with_that_payload_on_the_flange(payloads, nominal):
    found, design = payloads.candidate(FOUND), payloads.loaded(FOUND)
    rows = design.rows(nominal.experiments[0].trajectory)
    expected = design.predicted(rows)(design.carried)
    np.testing.assert_allclose([each.std for each in found.joints], expected.noise, rtol=1e-12)
    np.testing.assert_allclose([each.payload_std for each in found.joints], expected.payload, rtol=1e-12)
    assert found.refusal is None
    assert found.worst_as_made == pytest.approx(expected.total.max(), rel=1e-12)
    assert found.worst_as_made < 0.0055
    assert found.dimensions_mm == {"side": 53.0, "length": 212.0, "offset": 116.0}
    bare, loaded = rows.torques(design.carried.chi)
    torque = [each.payload_torque_rms for each in found.joints]
    np.testing.assert_allclose(torque, np.sqrt(((loaded - bare) ** 2).mean(axis=0)), rtol=1e-9)  # a difference
    whole = (53.0 * 53.0 * 212.0, (31.5 + 116.0 + 26.5) * 63.0 * 15.0)  # bar and bracket
    off = (whole[0] * 116.0 + whole[1] * (0.5 * 174.0 - 31.5)) / sum(whole)
    assert found.off_axis_mm == pytest.approx(off, rel=1e-9)
    moved = copy(payloads)  # the same weight, on a flange whose axis is 34 mm away
    moved.flange = replace(payloads.flange, origin=payloads.flange.origin + np.array([0.016, -0.03, 0.2]))
    assert moved.candidate(FOUND).off_axis_mm == pytest.approx(off, rel=1e-9)


def test_a_gain_is_shown_by_its_deviation_at_the_noise_floor_but_for_no_less_than_the_residual(payloads, nominal):
    std = np.array([each.std for each in payloads.candidate(FOUND).joints])
    between = float(np.sqrt(np.prod(np.sort(std)[2:4])))
    for floor, factor in ((0.005, 1.0), (0.02, 1.0), (0.05, 2.5)):
        gains = {"identification.gains.noise_floor": floor, "identification.gains.max_rel_std": factor * between}
        found = PayloadSearch(setup_of(with_settings(nominal.scenario, gains)), STEEL).candidate(FOUND)
        assert [each.shown for each in found.joints] == (std < between).tolist()


@pytest.mark.parametrize(
    ("weight", "most", "limit", "why"),
    [
        (FOUND, 5.9, 1.0, r"weighs 5\.97 kg, more than the robot's rated load of 5\.9 kg"),
        (FOUND, 6.0, 0.5, r"takes {} % of the torque of joint joint\d, where 80 % may be used"),
        (replace(FOUND, dimensions=(30.0, 40.0, 250.0)), 6.0, 1.0, None),
        (FAR, 6.0, 1.0, r"reaches \d+ mm into floor or arm"),
    ],
    ids=["heavy", "weak drives", "light", "far out"],
)
def test_a_payload_that_must_not_be_mounted_costs_more_than_any_other_and_says_why(
    payloads, nominal, weight, most, limit, why
):
    judged, limits = copy(payloads), payloads.design.limits
    judged.most = most
    judged.design = replace(payloads.design, limits=replace(limits, torque=limit * limits.torque))
    found = judged.refusal(weight)
    if why is None:
        assert found is None
        assert judged.cost(weight) < 0.0
        return
    motion = nominal.experiments[0].trajectory
    loaded = payloads.design.rows(motion, 200.0).torques(Carried.nominal(judged.payload(weight)).chi)
    share = (np.abs(loaded) / limits.torque).max() / limit
    assert re.search(why.format(f"{100.0 * share:.0f}"), found)
    assert judged.cost(weight) >= IMPOSSIBLE


def test_a_design_identifies_the_joint_that_the_paper_s_payload_cannot(designed):
    assert [each.shown for each in designed.before.joints] == [True] * 5 + [False]
    assert all(each.shown for each in designed.after.joints)
    assert designed.rated_load == 6.0
    assert designed.after.payload["mass"] <= 6.0
    assert designed.after.refusal is None
    assert {each.shape for each in designed.candidates} == {"bar", "cylinder", "plate"}
    errors = [np.array([(joint.std, joint.payload_std) for joint in each.joints]) for each in designed.candidates]
    costs = [objective(np.hypot(*each.T)) for each in errors]
    ranks = [(each.refusal is not None, cost) for each, cost in zip(designed.candidates, costs, strict=True)]
    assert ranks == sorted(ranks)
    words = " ".join(part.text for part in designed.parts() if hasattr(part, "text"))
    assert f"The {designed.after.shape} identifies every joint" in words
    assert "WARNING" not in words
    unrated = designed.model_copy(update={"rated_load": None}).parts()
    assert any("rated_load in robot.toml" in part.text for part in unrated if hasattr(part, "text"))


def test_the_scenario_s_own_payload_is_kept_where_it_is_better(nominal, designed, monkeypatch):
    """Designs one weight of a fixed accuracy beside an own payload that is better or worse by a tenth."""
    monkeypatch.setattr(PayloadSearch, "best", lambda self, *_: FOUND)
    monkeypatch.setattr(PayloadSearch, "candidate", lambda self, _: designed.candidates[0])
    for factor, better in ((0.9, True), (1.1, False)):
        std = factor * designed.after.worst
        joints = [each.model_copy(update={"std": std}) for each in designed.before.joints]
        own = designed.before.model_copy(update={"joints": joints})
        monkeypatch.setattr(PayloadSearch, "effect", lambda *_, own=own: own)
        found = design_payload(nominal, **SEARCH)
        assert found.own_is_better == better
        assert any("keep it" in part.text for part in found.parts() if hasattr(part, "text")) == better


def test_a_design_without_a_feasible_payload_or_for_a_bare_protocol_is_refused(nominal, monkeypatch, tmp_path):
    monkeypatch.setattr(PayloadSearch, "best", lambda self, *_: FAR)
    with pytest.raises(ScenarioError, match=r"nominal: no payload meets the limits: the best plate reaches \d+ mm"):
        design_payload(nominal, **SEARCH)
    path = tmp_path / "bare.toml"
    path.write_text('extends = "nominal"\n[experiment]\nprotocol = ["bare"]\n')
    with pytest.raises(ScenarioError, match="mounts no payload"):
        Design.of(setup_without_motion(load_scenario(str(path))))


@pytest.mark.usefixtures("_undiagnosed")
@pytest.mark.slow
def test_the_command_writes_a_payload_with_which_all_six_gains_are_identified(designed, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(module, "design_payload", lambda *_, **__: designed)
    out = tmp_path / "weight.toml"
    assert main(["payload", "nominal", "--out", str(out), "--json"]) == 0
    assert printed(capsys, "payload-design")["candidates"][0]["payload"] == payload_to_table(read_payload(out))
    table = designed.after.payload
    plant = {key: table[key] for key in ("mass", "com", "inertia")}
    # Seed 0; the deviations are a quarter of the tolerance.
    (tmp_path / "cell.toml").write_text(
        f'extends = "nominal"\n[plant]\npayload = {toml_value(plant)}\n[belief]\npayload = {toml_value(table)}\n'
        f"[tolerance]\ngain = {[0.02] * 6}\nidentifiable = [{', '.join(['true'] * 6)}]\n"
    )
    assert main(["run", str(tmp_path / "cell.toml")]) == 0
    hidden = [each.model_copy(update={"shown": each.joint != 4}) for each in designed.after.joints]
    after = designed.after.model_copy(update={"joints": hidden})
    monkeypatch.setattr(module, "design_payload", lambda *_, **__: designed.model_copy(update={"candidates": [after]}))
    capsys.readouterr()
    assert main(["payload", "nominal"]) == 1
    assert "No payload within the limits identifies joint 4." in capsys.readouterr().out
