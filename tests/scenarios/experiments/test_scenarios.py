import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from estimates import gain_estimate
from quick import quick_scenario

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import IdentificationError, OptionError
from scenarios.cli import main
from scenarios.experiments.judge import judge
from scenarios.experiments.motions import read_motion, write_motion
from scenarios.experiments.robots import robot
from scenarios.experiments.scenario import load_scenario, with_method
from scenarios.experiments.scenario_files import builtin_names
from scenarios.experiments.schema import ToleranceTable
from scenarios.experiments.setup import setup_of
from scenarios.support.errors import ScenarioError
from sim.errors import PlantError

pytestmark = pytest.mark.usefixtures("_computed_once")


def scenario_file(folder: Path, text: str) -> str:
    path = folder / "mine.toml"
    path.write_text(text)
    return str(path)


def test_a_gain_passes_within_tolerance_and_a_refusal_where_it_is_right():
    estimate = gain_estimate(1.009, 1.011, None, None, 1.0, -0.995, std=0.01, reason="too little load")
    tolerance = ToleranceTable(gain=(0.01,) * 6, identifiable=(True, True, False, True, False, True))
    verdict = judge(estimate, np.array([1.0, 1.0, 1.0, 1.0, 1.0, -1.0]), tolerance, expectation="mine.toml")
    assert [gain.passed for gain in verdict.gains] == [True, False, True, False, False, True]
    assert not verdict.passed
    total = np.linalg.norm([0.01, 0.02 * 1.009, 0.03 * 1.009])  # residual, payload, model
    np.testing.assert_allclose([verdict.gains[0].rel_error, verdict.gains[0].z], [0.009, 0.009 / total])
    np.testing.assert_allclose(verdict.gains[5].rel_error, -0.005)
    assert verdict.gains[1].reason == "off by +1.1 %, tolerance 1 %"
    assert verdict.gains[3].reason == "too little load"
    assert verdict.gains[4].reason == "identified, but tolerance.identifiable in mine.toml expects a refusal"


@pytest.mark.parametrize("name", builtin_names())
def test_built_in_scenarios_are_valid(name):
    setup = setup_of(load_scenario(name))
    assert setup.scenario.table.description
    assert setup.experiments[1].loaded


def test_the_catalog_has_the_promised_scenarios():
    assert {"ideal", "nominal", "paper-noise", "mass-only", "gain-error-20"} <= set(builtin_names())
    assert {"field", "field-two-weights", "coarse-encoder", "drift"} <= set(builtin_names())


def test_a_user_s_file_overlays_a_built_in_one(tmp_path):
    text = 'extends = "nominal"\n[plant]\ngain = [1, 2, 3, 4, 5, 6]\n[belief.payload]\nmass = 7.0\nknown = "mass"\n'
    setup = setup_of(load_scenario(scenario_file(tmp_path, text)))
    np.testing.assert_array_equal(setup.true_gain, [1, 2, 3, 4, 5, 6])
    assert setup.payloads["loaded"].known == "mass"
    assert setup.experiments[0].plant.payload.mass == 7.025  # the truth is not what is believed
    nominal = robot().drives
    np.testing.assert_array_equal(setup.experiments[0].plant.drives.viscous_friction, nominal.viscous_friction)


def test_model_errors_of_a_scenario_are_the_plant_s_and_not_the_controller_s(tmp_path):
    path = scenario_file(
        tmp_path,
        'extends = "nominal"\n[plant]\nrotor_inertia = [3, 3, 1, 1, 0.5, 0.3]\n'
        "[plant.errors]\nbase_tilt_x = 0.01\njoint_compliance = [1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 2e-4]",
    )
    unloaded = setup_of(load_scenario(path)).experiments[0]
    assert unloaded.plant.errors.base_tilt_x == 0.01
    assert unloaded.plant.errors.joint_compliance == (1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 2e-4)
    np.testing.assert_array_equal(unloaded.belief.rotor_inertia, robot().drives.rotor_inertia)


FAULTS = {
    'extends = "nominal"\n[plant]\ngian = [1]': "unknown key plant.gian; did you mean 'gain'?",
    'extends = "nominal"\n[experiment.sensors]\nencoder_noize = 1': "did you mean 'encoder_noise'?",
    'extends = "nominal"\n[plan]\ngain = [1]': "unknown key plan; did you mean 'plant'?",
    'extends = "nominl"': "unknown scenario 'nominl'; did you mean 'nominal'?",
    'extends = "mine.toml"': "extends itself through mine.toml -> mine.toml",
    "extends = 3": "expected the name of one scenario",
    'description = "x"': "plant: field required",
    'extends = "nominal"\n[plant]\ngain = [1, 2]': "plant.gain: 2 values, but tolerance.gain has 6",
    'extends = "nominal"\n[plant]\ngain = ["a", 1, 1, 1, 1, 1]': "plant.gain.0: .*valid number.* got 'a'",
    'extends = "nominal"\n[experiment]\nstep = -1': "experiment.step: .*greater than 0, got -1",
    'extends = "nominal"\n[experiment]\nmotion = "drive-gain"': "unknown motion .* did you mean 'drive-gains'?",
    'extends = "nominal"\n[belief]\npayload = "7 kg"': "unknown payload '7 kg'; did you mean '7.025 kg'?",
    'extends = "nominal"\n[belief]\ncontroller_gain = [1, 1, 1, 1, 1, 0]': "a gain of zero commands nothing",
    'extends = "nominal"\n[belief.payload]\nmas = 3': "belief.payload: unknown key 'mas'",
    "extends = = 3": "not TOML",
    'extends = "nominal"\n[belief]\ncouplings = [[5, 7]]': "belief.couplings: joints 5 and 7; .* from 1 to 6",
    'extends = "nominal"\n[belief]\ncouplings = [[0, 6]]': "belief.couplings: joints 0 and 6; .* from 1 to 6",
    'extends = "nominal"\n[belief]\ncouplings = [[5, 5]]': "belief.couplings: joints 5 and 5; expected two",
    'extends = "nominal"\n[belief]\ncouplings = [5, 6]': "belief.couplings.0: input should be a valid array, got 5",
    'extends = "nominal"\n[plant]\ngain = ["1", 1, 1, 1, 1, 1]': "plant.gain.0: .*valid number.* got '1'",
    'extends = "nominal"\n[experiment.controller]\nrate_hz = true': "experiment.controller.rate_hz: .*valid number",
    'extends = "nominal"\n[tolerance]\nidentifiable = [1, 1, 1, 1, 1, 0]': "tolerance.identifiable.0: .*valid boolean",
    'extends = "nominal"\n[experiment]\nstep = 1979-05-27': "experiment.step: .*valid number",
    'extends = "nominal"\n[plant]\ngain = [nan, 1, 1, 1, 1, 1]': "plant.gain.0: .*finite number",
    'extends = "nominal"\n[experiment.controller]\nrate_hz = 0.0': "rate_hz: input .* equal to 1, got 0",
    'extends = "nominal"\n[plant.payload]\nmass = 0\ncom = [0, 0, 0]': "payload.(mass: .*greater|inertia: .*required)",
    'extends = "nominal"\n[plant.errors]\nstribek = 0.1': "unknown key plant.errors.stribek; did you mean 'stribeck'?",
    'extends = "nominal"\n[plant.errors]\nwrist_coupling = 2.0': "wrist_coupling: input .* equal to 1, got 2",
    'extends = "nominal"\n[plant.errors]\njoint_compliance = [1e-5]': "joint_compliance: 1 values .* expected 6",
    'extends = "nominal"\n[experiment.sensors]\nencoder_noise = -1.0': "encoder_noise: input .* equal to 0, got -1",
    'extends = "nominal"\n[identification.observe]\ncutoff_hz = -1.0': r"observe\.cutoff_hz: input .* equal to 0\.001",
    'extends = "nominal"\n[identification.options]\nblocks = 7': "identification.options: unknown option 'blocks'",
    'extends = "nominal"\n[identification.gains]\nuncertainty = "x"': "expected one of classical, jackknife",
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_faulty_scenario_is_one_line_and_exit_status_2(tmp_path, text, capsys):
    path = scenario_file(tmp_path, text)
    with pytest.raises((ScenarioError, PlantError, IdentificationError), match=FAULTS[text]):
        setup_of(load_scenario(path))
    assert main(["run", path]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("rx90: ")
    assert output.err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[experiment.controller]\nrate_hz = 1e9",
            "rate_hz: input should be less than or equal to 100000, got 1000000000",
        ),
        (
            "[experiment.sensors]\ncoloured_cutoff_hz = 600.0",
            "coloured_cutoff_hz = 600 at 1000 Hz: expected 0.01 Hz or more, and less than 500 Hz",
        ),
    ],
)
def test_rates_that_do_not_fit_are_one_line_and_exit_status_2(tmp_path, capsys, text, message):
    assert main(["run", scenario_file(tmp_path, f'extends = "nominal"\n{text}\n')]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def judged(value: float, true: float, tolerance: float):
    estimate = gain_estimate(value, std=0.01, reason="")
    wanted = ToleranceTable(gain=(tolerance,), identifiable=(True,))
    return judge(estimate, np.array([true]), wanted, expectation="mine.toml").gains[0]


def test_an_error_is_judged_relative_to_the_true_gain_and_at_the_tolerance_it_passes():
    assert judged(41.0, 40.0, 0.03).passed  # 1 N m off, which is 2.5 %
    assert not judged(0.36, 0.32, 0.1).passed  # 0.04 N m off, which is 12.5 %
    assert judged(0.375, 0.5, 0.25).passed  # exactly at the tolerance, in binary too
    assert not judged(0.3749, 0.5, 0.25).passed


def test_the_reason_names_the_file_that_says_which_gains_the_data_should_give(tmp_path):
    assert load_scenario("paper").expectation == "nominal.toml"  # it extends paper-noise, which extends nominal
    assert load_scenario("mass-only").expectation == "mass-only.toml"
    path = scenario_file(tmp_path, 'extends = "mass-only"\n[tolerance]\npass_rate = 0.9')
    assert setup_of(load_scenario(path)).scenario.expectation == "mass-only.toml"


def test_identification_is_told_of_a_coupling_only_by_the_belief(tmp_path):
    injected = 'extends = "nominal"\n[plant.errors]\nwrist_coupling = 0.05\n'
    assert setup_of(load_scenario(scenario_file(tmp_path, injected))).structure.arm.couplings == ()
    told = setup_of(load_scenario(scenario_file(tmp_path, f"{injected}[belief]\ncouplings = [[5, 6]]")))
    assert told.structure.arm.couplings == ((4, 5),)
    assert told.experiments[1].plant.errors.wrist_coupling == 0.05


def test_motions_that_do_not_start_at_rest_are_refused(tmp_path):
    motion = read_motion("drive-gains", tmp_path)
    write_motion(replace(motion, sine=motion.sine + 0.01), tmp_path / "jerk.toml", [])
    path = scenario_file(tmp_path, 'extends = "nominal"\n[experiment]\nmotion = "jerk.toml"')
    with pytest.raises(ScenarioError, match="the motion does not start at rest"):
        setup_of(load_scenario(path))


def test_list_names_every_scenario_with_its_description(capsys):
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == builtin_names()


def test_usage_errors_exit_with_2(capsys):
    for arguments in (["--seed"], ["fly"], ["run", "nominal", "--seed", "-1"]):
        with pytest.raises(SystemExit) as caught:
            main(arguments)
        assert caught.value.code == 2
        output = capsys.readouterr()
        assert output.out == ""
        assert output.err.count("\n") == 1
        assert "--help" in output.err


KEYS = ["joint", "true", "estimate", "std", "rel_error", "z", "tolerance", "identifiable", "passed", "reason"]
KEYS += ["name", "residual_std", "payload_std", "model_std", "predicted_rel_std"]


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> tuple[Path, dict]:
    """A saved nominal run and what it printed."""
    folder = tmp_path_factory.mktemp("run") / "deep" / "er"
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()) as out:
        assert main(["run", "nominal", "--seed", "5", "--save", str(folder), "--json"]) == 0
    return folder, json.loads(out.getvalue())


def identify_arguments(folder: Path, **changes: object) -> list[str]:
    names = {
        "model": rx90_mjcf.MJCF,
        "unloaded": folder / "unloaded.parquet",
        "loaded": folder / "loaded.parquet",
        "payload": folder / "payload.toml",
    } | changes
    return ["identify", *(part for name, value in names.items() for part in (f"--{name}", str(value)))]


def test_json_of_a_run_keeps_the_contract(saved):
    _, result = saved
    kept = ["scenario", "seed", "passed", "gains", "payload", "fit", "timing", "notes", "cost"]
    assert list(result) == [*kept, "unseen", "diagnoses", "excluded", "untold"]
    assert (result["scenario"], result["seed"], result["passed"]) == ("nominal", 5, True)
    assert [list(gain) for gain in result["gains"]] == [KEYS] * 6
    assert list(result["fit"]) == ["method", "rows", "error_norm", "rel_error_norm", "sigma"]
    assert list(result["timing"]) == ["simulate_s", "identify_s"]
    refused = result["gains"][5]
    assert (refused["estimate"], refused["std"], refused["identifiable"], refused["passed"]) == (
        None,
        None,
        False,
        True,
    )
    assert "predicted standard deviation" in refused["reason"]


def test_save_writes_the_promised_files(saved):
    folder, result = saved
    names = {path.name for path in folder.iterdir()}
    files = {"unloaded.parquet", "loaded.parquet", "payload.toml", "truth.json", "result.json", ".rx90.json"}
    assert names == files | {"robot.xml", "record.json", "fit-rows.parquet"}
    assert json.loads((folder / "result.json").read_text()) == result
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["drives"]["gain"] == [gain["true"] for gain in result["gains"]]


def test_identify_on_saved_files_gives_the_same_estimate_to_the_last_digit(saved, capsys):
    folder, result = saved
    assert main([*identify_arguments(folder), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    for before, after in zip(result["gains"], again["gains"], strict=True):
        assert (after["estimate"], after["std"]) == (before["estimate"], before["std"])
        assert list(after) == KEYS
        assert after["true"] is after["rel_error"] is after["z"] is after["tolerance"] is after["passed"] is None
    assert again["fit"] == result["fit"]


@pytest.mark.parametrize("name", [pytest.param("paper", marks=pytest.mark.slow), "sequential"])
def test_the_printed_command_repeats_an_estimate_with_options_of_its_own(name, tmp_path, capsys):
    assert main(["run", name, "--save", str(tmp_path)]) == 0
    command = capsys.readouterr().out.splitlines()[-1]
    assert command.startswith("rx90 identify --model ")
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    result = json.loads((tmp_path / "result.json").read_text())
    assert [gain["estimate"] for gain in again["gains"]] == [gain["estimate"] for gain in result["gains"]]
    assert again["fit"] == result["fit"]


def test_identify_prints_a_table_for_people(saved, capsys):
    assert main(identify_arguments(saved[0])) == 0
    output = capsys.readouterr().out
    assert "5 of 6 gains identified" in output
    assert "Joint 6: predicted standard deviation" in output


def test_a_missed_tolerance_is_exit_status_1(tmp_path, capsys):
    path = quick_scenario(tmp_path)
    path.write_text(re.sub("^gain = .*$", "gain = [1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9]", path.read_text(), flags=re.M))
    assert main(["run", str(path)]) == 1
    assert re.search("FAILED: joints 1.* exceed their tolerance .worst: joint ", capsys.readouterr().out)


def test_identify_refuses_what_the_data_cannot_be(saved, tmp_path, capsys):
    folder, _ = saved
    degrees = tmp_path / "degrees.csv"
    log = read_recording(folder / "loaded.parquet")
    write_recording(Recording(log.t[:3000], np.rad2deg(log.q[:3000]), log.v[:3000]), degrees)
    cases = {
        "swapped": (
            {"unloaded": folder / "loaded.parquet", "loaded": folder / "unloaded.parquet"},
            "bare and loaded recordings are probably swapped",
        ),
        "twice": ({"loaded": folder / "unloaded.parquet"}, "contain the same motion"),
        "missing": ({"loaded": folder / "absent.parquet"}, "absent.parquet: no such file"),
        "degrees": ({"loaded": degrees}, "the log looks like degrees"),
        "no model": ({"model": folder / "payload.toml"}, "payload.toml: name is missing"),
        "no payload": ({"payload": folder / "absent.toml"}, "absent.toml: no such file"),
    }
    for changes, message in cases.values():
        assert main(identify_arguments(folder, **changes)) == 2
        output = capsys.readouterr()
        assert output.out == ""
        assert message in output.err
        assert output.err.count("\n") == 1


def test_an_unwritable_folder_is_one_line_and_exit_status_2(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["run", "ideal", "--save", str(tmp_path / "file" / "sub")]) == 2
    assert "Not a directory" in capsys.readouterr().err


def test_joints_are_numbered_from_one_and_notes_stand_beside_the_json(saved, tmp_path, capsys):
    folder, _ = saved
    log = read_recording(folder / "loaded.parquet")
    late = log.t + 2e-4 * np.sin(np.arange(len(log.t)))
    write_recording(Recording(late, log.q, log.v), tmp_path / "late.parquet")
    arguments = identify_arguments(folder, loaded=tmp_path / "late.parquet")
    assert main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:2] for line in lines if " joint" in line][:6] == [[str(k), f"joint{k}"] for k in range(1, 7)]
    assert main([*arguments, "--json"]) == 0
    output = capsys.readouterr()
    assert json.loads(output.out)["notes"]
    assert output.err.startswith("rx90: ")
    assert "sampling intervals vary by" in output.err


def test_options_overlay_a_scenario_s_own_and_are_checked_together(tmp_path):
    quick = load_scenario(str(quick_scenario(tmp_path)))
    stated = with_method(quick, "nls", ["gain-joint=2", "gain_value=0.7", "friction=viscous-coulomb"])
    other = with_method(stated, None, ["gain-joint=3"]).table.identification
    assert other.options == {"gain_joint": 3, "gain_value": 0.7, "friction": "viscous-coulomb"}
    assert with_method(stated, "nls", ["friction=cbrt"]).table.identification.options == {"friction": "cbrt"}
    with pytest.raises(OptionError, match="unknown option 'gain_joints'"):
        with_method(stated, None, ["gain-joints=3"])


def test_a_robot_model_and_the_folder_of_a_scenario_are_told_from_a_wrong_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my-arm").mkdir()
    Path("my-arm/scenario.toml").write_text('extends = "nominal"')
    with pytest.raises(ScenarioError, match=r"unknown scenario 'my-arm'; did you mean my-arm/scenario\.toml\?"):
        load_scenario("my-arm")
    Path("arm.urdf").write_text("<robot/>")
    with pytest.raises(ScenarioError, match=r"^arm\.urdf is a robot model; `rx90 new-robot` writes a scenario for it$"):
        load_scenario("arm.urdf")
