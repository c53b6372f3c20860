import json
import shlex
from dataclasses import replace

import pytest
from protocols import FOUR, protocol_setup, scenario_of

from ident.estimation.estimate import FoundParameter
from scenarios.cli import main
from scenarios.experiments.draws import check_draws
from scenarios.experiments.run import run
from scenarios.experiments.scenario import load_scenario, setup_of, value_at, with_settings
from scenarios.experiments.schema import TURNS, grouped, in_turns, motion_names, mountings
from scenarios.results.gains import Result
from scenarios.support.errors import ScenarioError, WrongValue


def test_motions_of_one_payload_are_identified_together_and_those_of_a_mounting_that_returns_are_in_turns():
    assert grouped(("bare", "light", "heavy", "bare")) == (0, 1, 2, 3)
    assert grouped(("bare", "light", "bare", "heavy", "light", "bare", "heavy")) == (0, 1, 4, 2, 3, 6, 5)
    turns = TURNS, ("bare", "loaded") * 2, ("light", "heavy", "heavy", "light"), ("bare", "bare", "heavy", "bare")
    assert all(map(in_turns, turns))
    blocks = ("bare", "loaded"), ("bare", "bare", "loaded", "loaded"), ("bare", "light", "heavy"), ("bare",)
    assert not any(map(in_turns, blocks))


def test_every_motion_has_the_payload_that_the_protocol_names_on_either_side(tmp_path):
    setup = protocol_setup(tmp_path, ("bare", "heavy", "bare", "light", "heavy"))
    assert [e.name for e in setup.experiments] == ["unloaded", "heavy", "unloaded-2", "light", "heavy-2"]
    assert [e.loaded for e in setup.experiments] == [False, True, False, True, True]
    assert [e.earlier for e in setup.experiments] == [0, 1, 2, 3, 4]
    assert [e.plant.payload.mass for e in setup.experiments if e.loaded] == [6.5, 4.275, 6.5]
    assert [None if p is None else p.mass for p in setup.mounted] == [None, 6.6, None, 4.275, 6.6]
    assert setup.mounted[1] is setup.mounted[4]
    assert list(setup.payloads) == ["heavy", "light"]


def test_what_is_known_is_said_for_every_payload_or_in_its_own_table(tmp_path):
    scenario_of(tmp_path, FOUR)
    for belief, expected in (
        ('[belief]\nknown = "mass"\n', ["mass", "mass"]),
        ('[belief.payloads.heavy]\nknown = "mass"\n', ["all", "mass"]),
        ("", ["all", "all"]),
    ):
        (tmp_path / "over.toml").write_text(f'extends = "mine.toml"\n{belief}')
        setup = setup_of(load_scenario(str(tmp_path / "over.toml")))
        for each in (setup, setup_of(setup.scenario)):
            assert [each.payloads[name].known for name in ("light", "heavy")] == expected


@pytest.mark.usefixtures("_undiagnosed")
def test_a_payload_parameter_has_a_truth_beside_it_only_where_there_is_one_payload(tmp_path):
    found = (FoundParameter(name="M", value=7.1, std=0.2),)
    for protocol, true in ((("bare", "loaded"), 7.025), (FOUR, None)):
        each = run(protocol_setup(tmp_path, protocol), 0)
        identification = replace(each.identification, estimate=replace(each.estimate, payload=found))
        assert Result.of_run(replace(each, identification=identification)).payload[0].true == true


def test_settings_reach_a_payload_by_the_name_of_its_mounting(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, FOUR))
    plant, believed = "plant.payloads.", "belief.payloads.light.mass"
    heavier = {f"{plant}heavy.mass": 5.5, f"{plant}heavy.inertia.izz": 0.0075}
    changed = with_settings(scenario, {**heavier, f"{plant}light.com": [0.01, 0.02, 0.03], believed: 4.5})
    setup = setup_of(changed)
    light, heavy = (setup.experiments[k].plant.payload for k in (1, 2))
    assert (heavy.mass, heavy.com, heavy.inertia[2]) == (5.5, (0.01, -0.02, 0.13), 0.0075)
    assert (light.mass, light.com) == (4.275, (0.01, 0.02, 0.03))
    assert [setup.payloads[name].mass for name in ("light", "heavy")] == [4.5, 6.6]
    assert value_at(changed.table, "plant.payloads.heavy.mass") == 5.5
    with pytest.raises(ScenarioError, match=r"no 'haevy' in plant\.payloads; did you mean 'heavy'\?"):
        with_settings(scenario, {"plant.payloads.haevy.mass": 5.5})


@pytest.mark.usefixtures("_undiagnosed")
def test_the_printed_command_gives_the_same_estimate_to_the_last_digit(tmp_path, capsys):
    protocol = ("loaded", "bare", "loaded", "light", "bare")
    path, folder = scenario_of(tmp_path, protocol), tmp_path / "saved"
    main(["run", path, "--seed", "2", "--save", str(folder)])
    command = capsys.readouterr().out.splitlines()[-1]
    expected = {f"{name}.parquet" for name in motion_names(protocol)}
    expected |= {"payload.toml" if name == "loaded" else f"payload-{name}.toml" for name in mountings(protocol)}
    always = {"robot.xml", "truth.json", "result.json", "fit-rows.parquet", "record.json", ".rx90.json"}
    assert {each.name for each in folder.iterdir()} == expected | always
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    again, result = json.loads(capsys.readouterr().out), json.loads((folder / "result.json").read_text())
    for key in ("estimate", "std"):
        assert [gain[key] for gain in again["gains"]] == [gain[key] for gain in result["gains"]]
    assert again["fit"] == result["fit"]


def test_a_draw_of_a_payload_that_no_motion_carries_is_refused(tmp_path):
    draw = '[random.mass]\ntarget = ["plant.{}.mass", "plant.payloads.heavy.mass"]\ndistribution = "norm"\n'
    for protocol, payload, said in (
        (("bare", "loaded"), "payloads.light", r"random\.mass: no 'light' in plant\.payloads; known: nothing"),
        (FOUR, "payload", r"plant\.payload: no motion of experiment\.protocol carries this payload"),
    ):
        with pytest.raises(WrongValue, match=said):
            check_draws(load_scenario(scenario_of(tmp_path, protocol, draw.format(payload))))
