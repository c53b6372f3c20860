"""Protocols: motions by what they carry, their payloads on either side, and how faulty ones are refused."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from protocols import FOUR, protocol_setup, scenario_of
from quick import quick_scenario

from ident.estimation.estimate import FoundParameter
from scenarios.cli import main
from scenarios.experiments.run import run
from scenarios.experiments.scenario import load_scenario, value_at, with_settings
from scenarios.experiments.schema import grouped, motion_names, mountings
from scenarios.experiments.setup import setup_of
from scenarios.results.gains import Result
from scenarios.support.errors import ScenarioError


def test_motions_are_called_by_what_they_carry_and_counted_where_it_comes_again():
    protocol = ("loaded", "bare", "light", "bare", "bare", "light")
    assert motion_names(protocol) == ("loaded", "unloaded", "light", "unloaded-2", "unloaded-3", "light-2")
    assert mountings(protocol) == ("loaded", "light")
    assert motion_names(("bare", "loaded")) == ("unloaded", "loaded")


def test_motions_of_one_payload_are_identified_together_and_all_others_in_order_of_time():
    assert grouped(("bare", "light", "heavy", "bare")) == (0, 1, 2, 3)
    assert grouped(("bare", "light", "bare", "heavy", "light", "bare", "heavy")) == (0, 1, 4, 2, 3, 6, 5)


def test_every_motion_has_the_payload_that_the_protocol_names_on_either_side(tmp_path):
    setup = protocol_setup(tmp_path, ("bare", "heavy", "bare", "light", "heavy"))
    assert [e.name for e in setup.experiments] == ["unloaded", "heavy", "unloaded-2", "light", "heavy-2"]
    assert [e.loaded for e in setup.experiments] == [False, True, False, True, True]
    assert [e.earlier for e in setup.experiments] == [0, 1, 2, 3, 4]
    assert [e.plant.payload.mass for e in setup.experiments if e.loaded] == [6.5, 4.275, 6.5]
    assert [None if p is None else p.mass for p in setup.mounted] == [None, 6.6, None, 4.275, 6.6]
    assert setup.mounted[1] is setup.mounted[4]
    assert list(setup.payloads) == ["heavy", "light"]


def test_a_pair_is_a_bare_and_a_loaded_motion_unless_a_protocol_is_stated(tmp_path):
    setup = setup_of(load_scenario(str(quick_scenario(tmp_path))))
    assert setup.protocol == ("bare", "loaded")
    assert [e.name for e in setup.experiments] == ["unloaded", "loaded"]
    assert [e.plant.payload.mass for e in setup.experiments] == [7.025, 7.025]


@pytest.mark.parametrize(
    ("known", "expected"),
    [('"mass"', ["mass", "mass"]), ('{ heavy = "mass" }', ["all", "mass"]), (None, ["all", "all"])],
)
def test_what_is_known_is_said_for_every_payload_or_for_one(tmp_path, known, expected):
    path = Path(scenario_of(tmp_path, FOUR))
    if known is not None:
        path.write_text(f"{path.read_text()}[belief]\nknown = {known}\n")
    setup = setup_of(load_scenario(str(path)))
    assert [setup.payloads[name].known for name in ("light", "heavy")] == expected
    again = setup_of(setup.scenario)
    assert [again.payloads[name].known for name in ("light", "heavy")] == expected


def test_a_payload_file_s_own_word_on_what_is_known_counts_for_its_mounting(tmp_path):
    more = (
        '[belief.payloads.third]\nmass = 3.0\nknown = "mass"\n[plant.payloads.third]\nmass = 3.0\ncom = [0, 0, 0.1]\n'
    )
    setup = protocol_setup(tmp_path, ("bare", "third", "light"), f"{more}inertia = {{ ixx = 1, iyy = 1, izz = 1 }}\n")
    assert [setup.payloads[name].known for name in ("third", "light")] == ["mass", "all"]


FAULTS = {
    'experiment.protocol = ["bare", "haevy"]': r"no payload 'haevy'; did you mean 'heavy'\?; known: bare, loaded",
    'experiment.protocol = ["bear", "heavy"]': r"experiment\.protocol: no payload 'bear'; did you mean 'bare'\?",
    "experiment.protocol = []": r"experiment\.protocol: 0 motions; expected 1 to 64",
    f"experiment.protocol = {json.dumps(['bare'] * 65)}": "65 motions; expected 1 to 64",
    "experiment.protocol = 3": r"experiment\.protocol: .*valid array",
    'plant.payloads."7 kg" = "7.025 kg"': r"plant\.payloads: '7 kg' is no name for a payload",
    'plant.payloads.bare = "7.025 kg"': r"'bare' is no name for a payload; expected small .*not bare or unloaded",
    'belief.payloads.unloaded = "7.025 kg"': r"belief\.payloads: 'unloaded' is no name for a payload",
    'plant.payloads.loaded = "7.025 kg"': r"plant: payload and payloads\.loaded denote the same payload",
    'belief.payloads.loaded = "7.025 kg"': r"belief: payload and payloads\.loaded denote the same payload",
    'plant.payloads.haevy = "7.025 kg"': r"plant has a payload 'haevy', belief has not; did you mean 'heavy'\?",
    'belief.payloads.lihgt = "7.025 kg"': r"belief has a payload 'lihgt', plant has not; did you mean 'light'\?",
    'plant.payloads.light = "4.257 kg"': r"unknown payload '4\.257 kg'; did you mean '4\.275 kg'\?",
    'belief.payloads.light = "4.257 kg"': r"unknown payload '4\.257 kg'; did you mean '4\.275 kg'\?",
    "plant.payloads.heavy.mas = 3.0": r"unknown key plant\.payloads\.heavy\.mas; did you mean 'mass'\?",
    "plant.payloads.heavy.mass = -3.0": r"plant\.payloads\.heavy\.mass: .*greater than 0, got -3",
    "belief.payloads.heavy.mas = 3.0": r"belief\.payloads\.heavy: payload: unknown key 'mas'; did you mean 'mass'\?",
    'belief.known = { haevy = "mass" }': r"belief\.known: no payload 'haevy'; did you mean 'heavy'\?",
    'belief.known = { heavy = "com" }': r"belief\.known\.heavy: .*'all' or 'mass', got 'com'",
    'belief.known = "com"': r"belief\.known: .*'all' or 'mass', got 'com'",
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_faulty_protocol_is_one_line_and_exit_status_2(tmp_path, text, capsys):
    scenario_of(tmp_path, FOUR)
    (tmp_path / "faulty.toml").write_text(f'extends = "mine.toml"\n{text}\n')
    with pytest.raises(ScenarioError, match=FAULTS[text]):
        setup_of(load_scenario(str(tmp_path / "faulty.toml")))
    assert main(["run", str(tmp_path / "faulty.toml")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_scenario_without_any_payload_is_refused(tmp_path):
    quick_scenario(tmp_path)
    text = (tmp_path / "quick.toml").read_text().replace('extends = "nominal"\n', "")
    rest = 'description = "x"\nplant = {}\nbelief.controller_gain = [1, 1, 1, 1, 1, 1]\nexperiment.step = 0.001\n'
    (tmp_path / "none.toml").write_text(rest + text.replace("[experiment]\nmotion", "experiment.motion"))
    with pytest.raises(ScenarioError, match=r"plant: no payload; state payload, or payloads by name"):
        load_scenario(str(tmp_path / "none.toml"))


def test_the_payload_called_loaded_may_stand_among_the_named_ones(tmp_path):
    quick_scenario(tmp_path)
    names = 'plant.payloads.loaded = "4.275 kg"\nbelief.payloads.loaded = "4.275 kg"\n'
    rest = f'description = "x"\n{names}belief.controller_gain = [1, 1, 1, 1, 1, 1]\nexperiment.step = 0.001\n'
    text = (tmp_path / "quick.toml").read_text().replace('extends = "nominal"\n', "")
    (tmp_path / "named.toml").write_text(rest + text.replace("[experiment]\nmotion", "experiment.motion"))
    setup = setup_of(load_scenario(str(tmp_path / "named.toml")))
    assert [e.name for e in setup.experiments] == ["unloaded", "loaded"]
    assert setup.experiments[1].plant.payload.mass == setup.payloads["loaded"].mass == 4.275


def test_an_experiment_may_have_64_motions(tmp_path):
    assert len(protocol_setup(tmp_path, ("bare", "light") * 32).experiments) == 64


def test_a_payload_parameter_has_a_truth_beside_it_only_where_there_is_one_payload(tmp_path, repeated):
    found = (FoundParameter(name="M", value=7.1, std=0.2),)
    several = run(protocol_setup(tmp_path, FOUR), 0)
    truths = []
    for each in (repeated, several):
        truths.append(Result.of_run(replace(each, estimate=replace(each.estimate, payload=found))).payload[0].true)
    assert truths == [7.025, None]


def test_settings_reach_a_payload_by_the_name_of_its_mounting(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, FOUR))
    changed = with_settings(
        scenario,
        {
            "plant.payloads.heavy.mass": 5.5,
            "plant.payloads.light.com": [0.01, 0.02, 0.03],
            "belief.payloads.light.mass": 4.5,
            "plant.payloads.heavy.inertia.izz": 0.0075,
        },
    )
    light, heavy = (setup_of(changed).experiments[k].plant.payload for k in (1, 2))
    assert (heavy.mass, heavy.com, heavy.inertia[2]) == (5.5, (0.01, -0.02, 0.13), 0.0075)
    assert (light.mass, light.com) == (4.275, (0.01, 0.02, 0.03))
    assert [setup_of(changed).payloads[name].mass for name in ("light", "heavy")] == [4.5, 6.6]
    assert value_at(changed.table, "plant.payloads.heavy.mass") == 5.5
    with pytest.raises(ScenarioError, match=r"no 'haevy' in plant\.payloads; did you mean 'heavy'\?"):
        with_settings(scenario, {"plant.payloads.haevy.mass": 5.5})
    with pytest.raises(ScenarioError, match=r"plant\.payloads\.heavy\.mass: .*greater than 0, got -1"):
        with_settings(scenario, {"plant.payloads.heavy.mass": -1.0})
