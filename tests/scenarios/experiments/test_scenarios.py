import json
from pathlib import Path

import numpy as np
import pytest
from estimates import gain_estimate
from printed import printed
from quick import BRIEF, quick_scenario

from ident.support.errors import OptionError
from scenarios.experiments.judge import judge
from scenarios.experiments.run import run
from scenarios.experiments.scenario import Setup, load_scenario, setup_of, value_at, with_method
from scenarios.experiments.scenario_files import builtin_names
from scenarios.experiments.schema import ToleranceTable
from scenarios.support.errors import ScenarioError

pytestmark = pytest.mark.usefixtures("_computed_once")


def setup(folder: Path, text: str) -> Setup:
    path = folder / "mine.toml"
    path.write_text(f'extends = "nominal"\n{text}')
    return setup_of(load_scenario(str(path)))


def test_a_gain_passes_within_tolerance_and_a_refusal_where_it_is_right():
    estimate = gain_estimate(1.009, 1.011, None, None, 1.0, -0.99005, std=0.01, reason="too little load")
    tolerance = ToleranceTable(gain=(0.01,) * 6, identifiable=(True, True, False, True, False, True))
    verdict = judge(estimate, np.array([1.0, 1.0, 1.0, 1.0, 1.0, -1.0]), tolerance)
    assert [gain.passed for gain in verdict.gains] == [True, False, True, False, False, True]
    assert not verdict.passed
    total = np.linalg.norm([0.01, 0.02 * 1.009, 0.03 * 1.009])  # residual, payload, model
    np.testing.assert_allclose([verdict.gains[0].rel_error, verdict.gains[0].z], [0.009, 0.009 / total])
    np.testing.assert_allclose(verdict.gains[5].rel_error, -0.00995)  # of the true gain; of its own 1.005 %
    assert verdict.gains[1].reason == "off by +1.1 %, tolerance 1 %"
    assert verdict.gains[3].reason == "too little load"
    assert verdict.gains[4].reason == "identified, but tolerance.identifiable expects a refusal"


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_scenarios_are_valid(name):
    found = setup_of(load_scenario(name))
    assert found.scenario.table.description
    assert found.experiments[1].loaded


def test_the_true_gain_of_a_law_is_that_at_the_rms_current_of_the_first_loaded_motion(tmp_path):
    law = "[plant.errors]\ntorque_constant_falls = 0.07\n[experiment]\nprotocol = ['bare', 'loaded', 'loaded']\n"
    found = setup(tmp_path, law)
    drives, currents = found.plant.drives, [k * np.array([[3.0, 2, 4, 7, 5, 9], [4, 5, 1, 2, 7, 2]]) for k in (2, 3, 5)]
    rms = 3.0 * np.sqrt([12.5, 14.5, 8.5, 26.5, 37.0, 42.5])
    expected = drives.gain * (1.0 - 0.07 * rms / drives.current_limit)
    np.testing.assert_allclose(found.gain_under(currents), expected, rtol=1e-12)


@pytest.mark.usefixtures("_undiagnosed")
def test_a_run_is_judged_by_the_gain_at_its_own_currents(tmp_path):
    path = quick_scenario(tmp_path, "[plant.errors]\ntorque_constant_falls = 0.3\n", lasts=BRIEF)
    found = run(setup_of(load_scenario(str(path))), 3)
    assert [gain.true for gain in found.verdict.gains] == found.truth.gain.tolist()
    assert (found.truth.gain < 0.99 * found.setup.true_gain).all()


def test_the_controller_has_the_believed_gains_and_the_nominal_rotors_not_those_of_the_plant(tmp_path):
    gains, rotors = (1.1, -0.9, 1.2, 0.7, 1.3, 0.8), "[0.4, 0.5, 0.3, 0.2, 0.1, 0.15]"
    found = setup(tmp_path, f"[belief]\ncontroller_gain = {list(gains)}\n[plant]\nrotor_inertia = {rotors}")
    assert {each.belief.gain for each in found.experiments} == {gains}
    believed = found.experiments[0].belief.robot.drives.rotor_inertia
    assert not np.isclose(believed, found.plant.drives.rotor_inertia).any()


def test_identification_is_told_of_a_coupling_only_by_the_belief(tmp_path):
    injected = "[plant.errors]\nwrist_coupling = 0.05\n"
    assert setup(tmp_path, injected).structure.arm.couplings == ()
    told = setup(tmp_path, f"{injected}[belief]\ncouplings = [[5, 6]]")
    assert told.structure.arm.couplings == ((4, 5),)
    assert told.experiments[1].plant.errors.wrist_coupling == 0.05


KEYS = ["joint", "true", "estimate", "std", "rel_error", "z", "tolerance", "identifiable", "passed", "reason"]
KEYS += ["name", "residual_std", "payload_std", "model_std", "predicted_rel_std"]


def test_json_of_a_run_keeps_the_contract(tmp_path, capsys):
    folder = tmp_path / "deep" / "er"
    result = printed(capsys, "result", ["run", "nominal", "--seed", "5", "--save", str(folder)])
    assert json.loads((folder / "result.json").read_text()) == result
    assert "://" not in (folder / "payload.toml").read_text()  # no path of the machine
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["drives"]["gain"] == [gain["true"] for gain in result["gains"]]
    kept = ["scenario", "seed", "passed", "gains", "payload", "fit", "timing", "notes", "cost", "sources", "mass"]
    assert list(result) == [*kept, "unseen", "diagnoses", "excluded", "untold"]
    assert (result["scenario"], result["seed"], result["passed"]) == ("nominal", 5, True)
    assert all(set(KEYS) <= set(gain) for gain in result["gains"])
    assert list(result["fit"]) == ["method", "rows", "error_norm", "rel_error_norm", "sigma"]
    assert list(result["timing"]) == ["simulate_s", "identify_s"]
    refused = result["gains"][5]
    assert [refused[key] for key in ("estimate", "std", "identifiable", "passed")] == [None, None, False, True]
    assert "predicted standard deviation" in refused["reason"]


def test_options_overlay_a_scenario_s_own_and_are_checked_together(tmp_path):
    quick = load_scenario(str(quick_scenario(tmp_path)))
    stated = with_method(quick, "nls", ["gain-joint=2", "gain_value=0.7", "friction=viscous-coulomb"])
    other = with_method(stated, None, ["gain-joint=3"]).table.identification
    assert other.options == {"gain_joint": 3, "gain_value": 0.7, "friction": "viscous-coulomb"}
    assert with_method(stated, "nls", ["friction=cbrt"]).table.identification.options == {"friction": "cbrt"}
    with pytest.raises(OptionError, match="unknown key 'gain_joints'"):
        with_method(stated, None, ["gain-joints=3"])


@pytest.mark.parametrize("place", ["sources.joint elasticity.shared", "tolerance.identifiable"])
def test_truth_values_are_no_numbers_that_a_study_varies(place):
    with pytest.raises(
        ScenarioError, match=f"{place} holds .*True.*; expected a number, an array of numbers or a name"
    ):
        value_at(load_scenario("nominal").table, place)


@pytest.mark.parametrize("name", ["field", "field-two-weights"])
def test_in_the_field_a_payload_is_believed_with_the_deviations_that_it_is_drawn_with(name):
    found = setup_of(load_scenario(name))
    table = found.scenario.table
    mass_std, com_std, share = (
        table.random[f"payload {what}"].parameters["scale"] for what in ("mass", "centre", "inertia")
    )
    for mounting, believed in found.payloads.items():
        place = "plant.payload" if mounting == "loaded" else f"plant.payloads.{mounting}"
        assert (believed.mass, believed.mass_std) == (value_at(table, f"{place}.mass"), mass_std)
        assert (list(believed.com), believed.com_std) == (value_at(table, f"{place}.com"), (com_std,) * 3)
        inertia, std = list(believed.inertia[:3]), believed.inertia_std[:3]
        assert inertia == [value_at(table, f"{place}.inertia.{key}") for key in ("ixx", "iyy", "izz")]
        np.testing.assert_allclose(std, share * np.array(inertia), rtol=0.02)  # two digits are stated
