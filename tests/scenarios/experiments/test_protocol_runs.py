"""Protocols as they are run, in batches, and what a run of one saves."""

import json
import shlex

import numpy as np
import pytest
from protocols import FOUR, protocol_setup, scenario_of
from quick import quick_scenario

from ident.payload.payload import read_payload
from ident.recordings.files import read_recording
from ident.support.errors import NotIdentifiable
from scenarios.cli import main
from scenarios.experiments.run import motion_streams, run
from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.schema import motion_names, mountings
from scenarios.experiments.setup import setup_of
from sim.errors import Saturated


def test_further_motions_leave_the_first_two_as_they_are_and_have_noise_of_their_own(repeated, tmp_path):
    pair = run(setup_of(load_scenario(str(quick_scenario(tmp_path)))), 5)
    bare, loaded, bare_again, loaded_again = repeated.recordings
    for before, after in zip(pair.recordings, (bare, loaded), strict=True):
        np.testing.assert_array_equal(before.q, after.q)
        np.testing.assert_array_equal(before.v, after.v)
    for first, second in ((bare, bare_again), (loaded, loaded_again)):
        # White noise of 5 % and coloured noise of 2 % of the rms current, drawn twice. The coloured one has some 200
        # independent values, and makes a seventh of the variance; encoders, in the loop, make up to a sixth on joint 1.
        share = np.std(first.v - second.v, axis=0) / np.sqrt(np.mean(first.v**2, axis=0))
        np.testing.assert_allclose(share, np.sqrt(2 * (0.05**2 + 0.02**2)), rtol=0.1)


def test_noise_of_every_motion_differs_and_does_not_depend_on_how_many_follow():
    pair, four = (motion_streams(7, {"white": 9}, motions) for motions in (2, 4))
    assert [s["white"].random() for s in pair] == [s["white"].random() for s in four][:2]
    assert len({s["encoder"].random() for s in motion_streams(7, {}, 4)}) == 4
    assert len({s["white"].random() for s in motion_streams(7, {"white": 9}, 4)}) == 4


def test_a_motion_that_fails_costs_its_run_with_its_own_name(tmp_path):
    heavy = "[plant.payloads.heaviest]\nmass = 95.0\ncom = [0, 0, 0.1]\ninertia = { ixx = 1, iyy = 1, izz = 1 }\n"
    more = f'{heavy}[belief.payloads.heaviest]\nmass = 95.0\nknown = "mass"\n'
    setup = protocol_setup(tmp_path, ("bare", "light", "heaviest"), more)
    with pytest.raises(Saturated, match=r"^heaviest: drive of joint3 at its limit"):
        run(setup, 0)


@pytest.mark.parametrize(
    "protocol",
    [
        ("loaded", "bare", "loaded", "light", "bare"),
        pytest.param(FOUR, marks=pytest.mark.slow),
        pytest.param(("light", "bare", "bare"), marks=pytest.mark.slow),
    ],
)
def test_the_printed_command_gives_the_same_estimate_to_the_last_digit(tmp_path, capsys, protocol):
    path, folder = scenario_of(tmp_path, protocol), tmp_path / "saved"
    main(["run", path, "--seed", "2", "--save", str(folder)])
    command = capsys.readouterr().out.splitlines()[-1]
    expected = {f"{name}.parquet" for name in motion_names(protocol)}
    expected |= {"payload.toml" if name == "loaded" else f"payload-{name}.toml" for name in mountings(protocol)}
    assert {each.name for each in folder.iterdir()} == expected | {
        "robot.xml",
        "truth.json",
        "result.json",
        "fit-rows.parquet",
        "record.json",
        ".rx90.json",
    }
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    again, result = json.loads(capsys.readouterr().out), json.loads((folder / "result.json").read_text())
    for key in ("estimate", "std"):
        assert [gain[key] for gain in again["gains"]] == [gain[key] for gain in result["gains"]]
    assert again["fit"] == result["fit"]


def test_the_files_of_a_run_hold_its_motions_payloads_and_truth(tmp_path, capsys):
    path, folder = scenario_of(tmp_path, FOUR), tmp_path / "saved"
    main(["run", path, "--save", str(folder)])
    found = run(setup_of(load_scenario(path)), 0)
    for name, recording in zip(("unloaded", "light", "heavy", "unloaded-2"), found.recordings, strict=True):
        np.testing.assert_array_equal(read_recording(folder / f"{name}.parquet").v, recording.v)
    assert read_payload(folder / "payload-heavy.toml").mass == 6.6
    assert read_payload(folder / "payload-light.toml").mass == 4.275
    truth = json.loads((folder / "truth.json").read_text())
    assert {name: body["mass"] for name, body in truth["payloads"].items()} == {"light": 4.275, "heavy": 6.5}
    assert "payload" not in truth
    assert main(["run", path, "--save", str(folder)]) in (0, 1)  # over its own files
    (folder / "unloaded-2.parquet").write_text("mine")
    capsys.readouterr()
    assert main(["run", path, "--save", str(folder)]) == 2
    assert "unloaded-2.parquet: changed since" in capsys.readouterr().err


def test_a_protocol_that_the_method_cannot_use_fails_as_the_estimator_says(tmp_path):
    with pytest.raises(NotIdentifiable, match="no motion carries a payload"):
        run(protocol_setup(tmp_path, ("bare", "bare")), 0)
    assert protocol_setup(tmp_path, ("bare",)).payloads == {}
