import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from quick import quick_scenario

import rx90_mjcf
import scenarios.commands.identify as command
from ident.arm import load_arm
from ident.consistency import UNCHECKED
from ident.errors import NotIdentifiable
from ident.estimate import FoundParameter
from ident.identification import Recorded, identify_motions
from ident.options import GainOptions
from ident.payload_files import read_payload
from ident.recording import Recording
from ident.recording_files import read_recording, write_recording
from scenarios.build import Bench, bench
from scenarios.cli import main
from scenarios.errors import ScenarioError, UnknownPlace, WrongDraw
from scenarios.files.draws import check_draws, drawn_settings
from scenarios.files.loading import load_scenario
from scenarios.files.mountings import grouped, motion_names, mountings
from scenarios.files.settings import value_at, with_settings
from scenarios.robots import robot
from scenarios.run import Run, motion_streams, run, run_batch
from scenarios.store.documents import run_document, to_json
from scenarios.store.run_folder import save_run
from scenarios.studies.sensitivity import settings_with, sources_of
from scenarios.trials import Trial, run_trials, trial_schema

TWO = """
[plant.payloads]
light = "4.275 kg"
heavy = { mass = 6.5, com = [0.01, -0.02, 0.13], inertia = { ixx = 0.011, iyy = 0.012, izz = 0.008 } }
[belief.payloads]
light = "4.275 kg"
heavy = { mass = 6.6, mass_std = 0.1, com = [0.0, 0.0, 0.13], inertia = { ixx = 0.011, iyy = 0.012, izz = 0.008 } }
"""
FOUR = ("bare", "light", "heavy", "bare")


def scenario_of(folder: Path, protocol: tuple[str, ...], more: str = "") -> str:
    """A quick scenario with a protocol of its own and payloads `loaded`, `light` and `heavy`."""
    quick_scenario(folder)
    path = folder / "mine.toml"
    path.write_text(f'extends = "quick.toml"\nexperiment.protocol = {json.dumps(protocol)}\n{TWO}{more}')
    return str(path)


def bench_of(folder: Path, protocol: tuple[str, ...], more: str = "") -> Bench:
    return bench(load_scenario(scenario_of(folder, protocol, more)))


def test_motions_are_called_by_what_they_carry_and_counted_where_it_comes_again():
    protocol = ("loaded", "bare", "light", "bare", "bare", "light")
    assert motion_names(protocol) == ("loaded", "unloaded", "light", "unloaded-2", "unloaded-3", "light-2")
    assert mountings(protocol) == ("loaded", "light")
    assert motion_names(("bare", "loaded")) == ("unloaded", "loaded")


def test_motions_of_one_payload_are_identified_together_and_all_others_in_order_of_time():
    assert grouped(("bare", "light", "heavy", "bare")) == (0, 1, 2, 3)
    assert grouped(("bare", "light", "bare", "heavy", "light", "bare", "heavy")) == (0, 1, 4, 2, 3, 6, 5)


def test_every_motion_has_the_payload_that_the_protocol_names_on_either_side(tmp_path):
    prepared = bench_of(tmp_path, ("bare", "heavy", "bare", "light", "heavy"))
    assert [e.name for e in prepared.experiments] == ["unloaded", "heavy", "unloaded-2", "light", "heavy-2"]
    assert [e.loaded for e in prepared.experiments] == [False, True, False, True, True]
    assert [e.earlier for e in prepared.experiments] == [0, 1, 2, 3, 4]
    assert [e.plant.payload.mass for e in prepared.experiments if e.loaded] == [6.5, 4.275, 6.5]
    assert [None if p is None else p.mass for p in prepared.mounted] == [None, 6.6, None, 4.275, 6.6]
    assert prepared.mounted[1] is prepared.mounted[4]
    assert list(prepared.payloads) == ["heavy", "light"]


def test_a_pair_is_a_bare_and_a_loaded_motion_unless_a_protocol_is_stated(tmp_path):
    prepared = bench(load_scenario(str(quick_scenario(tmp_path))))
    assert prepared.protocol == ("bare", "loaded")
    assert [e.name for e in prepared.experiments] == ["unloaded", "loaded"]
    assert [e.plant.payload.mass for e in prepared.experiments] == [7.025, 7.025]


@pytest.mark.parametrize(
    ("known", "expected"),
    [('"mass"', ["mass", "mass"]), ('{ heavy = "mass" }', ["all", "mass"]), (None, ["all", "all"])],
)
def test_what_is_known_is_said_for_every_payload_or_for_one(tmp_path, known, expected):
    path = Path(scenario_of(tmp_path, FOUR))
    if known is not None:
        path.write_text(f"{path.read_text()}[belief]\nknown = {known}\n")
    prepared = bench(load_scenario(str(path)))
    assert [prepared.payloads[name].known for name in ("light", "heavy")] == expected
    again = bench(prepared.scenario)
    assert [again.payloads[name].known for name in ("light", "heavy")] == expected


def test_a_payload_file_s_own_word_on_what_is_known_counts_for_its_mounting(tmp_path):
    more = (
        '[belief.payloads.third]\nmass = 3.0\nknown = "mass"\n[plant.payloads.third]\nmass = 3.0\ncom = [0, 0, 0.1]\n'
    )
    prepared = bench_of(tmp_path, ("bare", "third", "light"), f"{more}inertia = {{ ixx = 1, iyy = 1, izz = 1 }}\n")
    assert [prepared.payloads[name].known for name in ("third", "light")] == ["mass", "all"]


FAULTS = {
    'experiment.protocol = ["bare", "haevy"]': r"no payload 'haevy'; did you mean 'heavy'\?; known: bare, loaded",
    'experiment.protocol = ["bear", "heavy"]': r"experiment\.protocol: no payload 'bear'; did you mean 'bare'\?",
    "experiment.protocol = []": r"experiment\.protocol: 0 motions; expected 1 to 64",
    f"experiment.protocol = {json.dumps(['bare'] * 65)}": "65 motions; expected 1 to 64",
    "experiment.protocol = 3": r"experiment\.protocol: .*valid array",
    'plant.payloads."7 kg" = "7.025 kg"': r"plant\.payloads: '7 kg' is no name for a payload",
    'plant.payloads.bare = "7.025 kg"': r"'bare' is no name for a payload; expected small .*not bare or unloaded",
    'belief.payloads.unloaded = "7.025 kg"': r"belief\.payloads: 'unloaded' is no name for a payload",
    'plant.payloads.loaded = "7.025 kg"': r"plant: payload and payloads\.loaded are the same one",
    'belief.payloads.loaded = "7.025 kg"': r"belief: payload and payloads\.loaded are the same one",
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
        bench(load_scenario(str(tmp_path / "faulty.toml")))
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
    prepared = bench(load_scenario(str(tmp_path / "named.toml")))
    assert [e.name for e in prepared.experiments] == ["unloaded", "loaded"]
    assert prepared.experiments[1].plant.payload.mass == prepared.payloads["loaded"].mass == 4.275


def test_an_experiment_may_have_64_motions(tmp_path):
    assert len(bench_of(tmp_path, ("bare", "light") * 32).experiments) == 64


def test_a_payload_parameter_has_a_truth_beside_it_only_where_there_is_one_payload(tmp_path, repeated):
    found = (FoundParameter(name="M", value=7.1, std=0.2),)
    several = run(bench_of(tmp_path, FOUR), 0)
    truths = []
    for each in (repeated, several):
        document = run_document(replace(each, estimate=replace(each.estimate, payload=found)))
        truths.append(json.loads(to_json(document))["payload"][0]["true"])
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
    light, heavy = (bench(changed).experiments[k].plant.payload for k in (1, 2))
    assert (heavy.mass, heavy.com, heavy.inertia[2]) == (5.5, (0.01, -0.02, 0.13), 0.0075)
    assert (light.mass, light.com) == (4.275, (0.01, 0.02, 0.03))
    assert [bench(changed).payloads[name].mass for name in ("light", "heavy")] == [4.5, 6.6]
    assert value_at(changed.table, "plant.payloads.heavy.mass") == 5.5
    with pytest.raises(UnknownPlace, match=r"no 'haevy' in plant\.payloads; did you mean 'heavy'\?"):
        with_settings(scenario, {"plant.payloads.haevy.mass": 5.5})
    with pytest.raises(ScenarioError, match=r"plant\.payloads\.heavy\.mass: .*greater than 0, got -1"):
        with_settings(scenario, {"plant.payloads.heavy.mass": -1.0})


DRAW = """
[random."payload mass"]
target = ["plant.payloads.light.mass", "plant.payloads.heavy.mass"]
distribution = "norm"
parameters = { scale = 0.1 }
apply = "add"
"""


def test_draws_reach_every_payload_by_itself(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, FOUR, DRAW))
    drawn = np.array([list(drawn_settings(scenario, seed).values()) for seed in range(200)])
    # Means and correlation of 200 pairs: beyond 4 standard errors once in 5000 choices of seeds.
    np.testing.assert_allclose(drawn.mean(axis=0), [4.275, 6.5], rtol=0, atol=4 * 0.1 / np.sqrt(200))
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4 / np.sqrt(200)
    trials = [Trial(number=k, seed=k) for k in (3, 4)]
    places = ["plant.payloads.heavy.mass", "plant.payloads.light.mass"]
    rows = run_trials(scenario, trials, trial_schema(scenario, places, ()), threads=2).to_pandas()
    np.testing.assert_array_equal(rows[places[::-1]].to_numpy()[::6], drawn[3:5])
    assert rows["failure"].isna().all()
    single = run(bench(scenario), 4)
    again = rows[rows.trial == 4]["estimate"].to_numpy()[:3]
    np.testing.assert_array_equal([gain.estimate for gain in single.verdict.gains[:3]], again)


def test_a_trial_s_own_seed_of_a_noise_stream_changes_its_gains(tmp_path):
    scenario = load_scenario(str(quick_scenario(tmp_path)))
    trials = [Trial(number=k, seed=4, settings={}, streams=own) for k, own in enumerate(({}, {"white": 9}))]
    rows = run_trials(scenario, trials, trial_schema(scenario, (), ()), threads=2).to_pandas()
    plain, own = (rows[rows.trial == k]["estimate"].to_numpy()[:3] for k in (0, 1))
    assert np.isfinite(plain).all()
    assert (plain != own).all()


def test_a_draw_of_a_payload_that_no_motion_carries_is_refused(tmp_path):
    scenario = load_scenario(scenario_of(tmp_path, ("bare", "loaded"), DRAW))
    with pytest.raises(WrongDraw, match=r"random\.payload mass: no 'light' in plant\.payloads; known: nothing"):
        check_draws(scenario, bench)
    scenario = load_scenario(scenario_of(tmp_path, FOUR, DRAW.replace("payloads.light.mass", "payload.mass")))
    with pytest.raises(WrongDraw, match=r"plant\.payload: no motion of experiment\.protocol carries it"):
        check_draws(scenario, bench)


@pytest.fixture(scope="module")
def repeated(tmp_path_factory) -> Run:
    return run(bench_of(tmp_path_factory.mktemp("repeated"), ("bare", "loaded", "bare", "loaded")), 5)


def test_further_motions_leave_the_first_two_as_they_are_and_have_noise_of_their_own(repeated, tmp_path):
    pair = run(bench(load_scenario(str(quick_scenario(tmp_path)))), 5)
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


def test_scenarios_of_unlike_protocols_share_a_batch(tmp_path):
    folders = [tmp_path / name for name in ("a", "b", "c")]
    for folder in folders:
        folder.mkdir()
    protocols = (("bare", "loaded"), FOUR, ("loaded", "bare", "bare"))
    benches = [bench_of(folder, protocol) for folder, protocol in zip(folders, protocols, strict=True)]
    entries = [(each, 3 + k) for k, each in enumerate(benches)]
    streams = [motion_streams(seed, {}, len(each.experiments)) for each, seed in entries]
    together = dict(run_batch(entries, streams, threads=2, checks=UNCHECKED))
    for k, (each, seed) in enumerate(entries):
        one, other = run(each, seed), together[k]
        assert isinstance(other, Run)
        assert [r.name for r in other.recordings] == [e.name for e in each.experiments]
        for first, second in zip(one.recordings, other.recordings, strict=True):
            np.testing.assert_array_equal(first.v, second.v)
        assert [g.estimate for g in one.verdict.gains] == [g.estimate for g in other.verdict.gains]


def test_a_motion_that_fails_costs_its_run_with_its_own_name(tmp_path):
    heavy = "[plant.payloads.heaviest]\nmass = 95.0\ncom = [0, 0, 0.1]\ninertia = { ixx = 1, iyy = 1, izz = 1 }\n"
    more = f'{heavy}[belief.payloads.heaviest]\nmass = 95.0\nknown = "mass"\n'
    prepared = bench_of(tmp_path, ("bare", "light", "heaviest"), more)
    ((_, outcome),) = run_batch([(prepared, 0)], [motion_streams(0, {}, 3)], threads=2, checks=UNCHECKED)
    assert str(outcome).startswith("heaviest: drive of joint3 at its limit")


@pytest.mark.parametrize("protocol", [FOUR, ("loaded", "bare", "loaded", "light", "bare"), ("light", "bare", "bare")])
def test_the_printed_command_gives_the_same_estimate_to_the_last_digit(tmp_path, capsys, protocol):
    path, folder = scenario_of(tmp_path, protocol), tmp_path / "saved"
    main(["run", path, "--seed", "2", "--save", str(folder)])
    command = capsys.readouterr().out.splitlines()[-1]
    expected = {f"{name}.parquet" for name in motion_names(protocol)}
    expected |= {"payload.toml" if name == "loaded" else f"payload-{name}.toml" for name in mountings(protocol)}
    assert {each.name for each in folder.iterdir()} == expected | {"robot.xml", "truth.json", "result.json", "record.json", ".rx90.json"}
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    again, result = json.loads(capsys.readouterr().out), json.loads((folder / "result.json").read_text())
    for key in ("estimate", "std", "total_std"):
        assert [gain[key] for gain in again["gains"]] == [gain[key] for gain in result["gains"]]
    assert again["fit"] == result["fit"]


def test_the_files_of_a_run_hold_its_motions_payloads_and_truth(tmp_path, capsys):
    path, folder = scenario_of(tmp_path, FOUR), tmp_path / "saved"
    main(["run", path, "--save", str(folder)])
    found = run(bench(load_scenario(path)), 0)
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


@pytest.fixture(scope="module")
def saved(repeated, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("saved")
    save_run(repeated, folder)
    return folder


def words(folder: Path, *names: str) -> list[str]:
    """`rx90 identify` of files in a folder; what begins with a hyphen stays."""
    files = [name if name.startswith("--") else str(folder / name) for name in names]
    return ["identify", "--model", str(rx90_mjcf.MJCF), *files]


UNPAIRED = {
    ("--loaded", "loaded.parquet"): "loaded.parquet: no payload is given behind it; describe what was mounted",
    (
        "--unloaded",
        "unloaded.parquet",
        "--payload",
        "payload.toml",
    ): "payload.toml: no --loaded without a payload comes",
    ("--loaded", "loaded.parquet", "--payload", "payload.toml", "--payload", "other.toml"): "other.toml: no --loaded",
    ("--payload", "p.toml", "--loaded", "a", "--loaded", "b", "--payload", "q.toml"): "p.toml: no --loaded",
    ("--loaded", "a", "--loaded", "b", "--payload", "p.toml"): "a: no payload is given behind it",
    ("--loaded", "a", "--payload", "p.toml", "--loaded", "b"): "b: no payload is given behind it",
    ("--loaded", "a", "--unloaded", "b", "--payload", "p.toml", "--payload", "q.toml"): "a: no payload is given",
    ("--payload", "payload.toml"): "no recording is given; expected --unloaded A and --loaded B --payload P",
    (): "no recording is given",
    ("--unloaded", "unloaded.parquet"): "bare motions give no ratio of gains",
    ("--unloaded", "unloaded.parquet", "unloaded-2.parquet"): "bare motions give no ratio of gains",
    ("--loaded", "loaded.parquet", "loaded-2.parquet", "--payload", "payload.toml"): "no drive gain can be identified",
    ("--unloaded", "unloaded.parquet", "unloaded.parquet"): "hold the same motion",
}


@pytest.mark.parametrize("names", UNPAIRED)
def test_files_that_do_not_go_together_are_one_line_and_exit_status_2(saved, names, capsys):
    assert main(words(saved, *names)) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert UNPAIRED[names] in output.err
    assert output.err.count("\n") == 1


def estimates(arguments: list[str], capsys) -> list[float | None]:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return [gain["estimate"] for gain in json.loads(capsys.readouterr().out)["gains"]]


def test_an_only_payload_may_stand_before_the_only_loaded_group(saved, capsys):
    loaded, payload = ("--loaded", "loaded.parquet"), ("--payload", "payload.toml")
    usual = estimates(words(saved, "--unloaded", "unloaded.parquet", *loaded, *payload), capsys)
    other = estimates(words(saved, *payload, "--unloaded", "unloaded.parquet", *loaded), capsys)
    assert usual == other


def test_every_group_is_a_mounting_of_its_own(saved, capsys):
    # As `identify_motions` is told by payloads that are one object or two.
    bare, loaded, again = (read_recording(saved / f"{n}.parquet") for n in ("unloaded", "loaded", "loaded-2"))
    (saved / "mass.toml").write_text('mass = 7.025\nknown = "mass"\n')
    one, two = read_payload(saved / "mass.toml"), read_payload(saved / "mass.toml")
    arm, wide = load_arm(robot().model), GainOptions(max_rel_std=3.0)  # 6 s show little of a mass alone
    shared, apart = (
        [j.value if hasattr(j, "value") else None for j in identify_motions(motions, arm, gains=wide).estimate.joints]
        for motions in (
            (Recorded(bare), Recorded(loaded, one), Recorded(again, one)),
            (Recorded(bare), Recorded(loaded, one), Recorded(again, two)),
        )
    )
    assert shared != apart
    start = ("--unloaded", "unloaded.parquet", "--loaded", "loaded.parquet")
    one_group = words(saved, *start, "loaded-2.parquet", "--payload", "mass.toml")
    two = words(saved, *start, "--payload", "mass.toml", "--loaded", "loaded-2.parquet", "--payload", "mass.toml")
    assert estimates([*one_group, "--max-rel-std", "3"], capsys) == shared
    assert estimates([*two, "--max-rel-std", "3"], capsys) == apart


def test_motions_with_absolute_time_are_taken_in_its_order_and_others_as_given(saved, tmp_path, capsys, monkeypatch):
    seen: list[list[float]] = []
    original = command.identify_motions

    def watched(motions, *rest, **named):
        seen.append([round(float(motion.recording.t[0])) for motion in motions])
        return original(motions, *rest, **named)

    monkeypatch.setattr(command, "identify_motions", watched)
    for name, start in (("unloaded", 1.7e9 + 40), ("loaded", 1.7e9 + 90), ("unloaded-2", 1.7e9), ("loaded-2", 50.0)):
        log = read_recording(saved / f"{name}.parquet")
        write_recording(Recording(log.t + start, log.q, log.v), tmp_path / f"{name}.parquet")
    (tmp_path / "payload.toml").write_text((saved / "payload.toml").read_text())
    bare = ("--unloaded", "unloaded.parquet", "unloaded-2.parquet", "--loaded", "loaded.parquet")
    assert main(words(tmp_path, *bare, "--payload", "payload.toml")) == 0
    assert main(words(tmp_path, *bare, "loaded-2.parquet", "--payload", "payload.toml")) == 0
    assert seen == [
        [1_700_000_000, 1_700_000_040, 1_700_000_090],
        [1_700_000_040, 1_700_000_000, 1_700_000_090, 50],
    ]
    with pytest.raises(SystemExit):
        main(["identify", "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert "in order of time if all files have absolute time (seconds since 1970), otherwise in the order given" in said


def test_a_protocol_that_the_method_cannot_use_fails_as_the_estimator_says(tmp_path):
    with pytest.raises(NotIdentifiable, match="no motion carries a payload"):
        run(bench_of(tmp_path, ("bare", "bare")), 0)
    assert bench_of(tmp_path, ("bare",)).payloads == {}


@pytest.mark.parametrize(
    ("name", "payloads"), [("field", ("payload",)), ("field-two-weights", ("payloads.light", "payloads.heavy"))]
)
def test_in_the_field_every_run_draws_every_error_and_every_payload(name, payloads):
    scenario = load_scenario(name)
    check_draws(scenario, bench)
    first, second = (drawn_settings(scenario, seed) for seed in (1, 2))
    errors = {"load_friction", "coulomb_drift", "viscous_drift", "coulomb_by_direction", "viscous_by_direction"}
    errors |= {"joint_compliance", "base_tilt_x", "base_tilt_y", "d3_error", "r4_error"}
    places = {f"plant.errors.{error}" for error in errors}
    for payload in payloads:
        places |= {f"plant.{payload}.{key}" for key in ("mass", "com", "inertia.ixx", "inertia.iyy", "inertia.izz")}
    assert set(first) == places
    signs = {"plant.errors.coulomb_by_direction": 0.3, "plant.errors.viscous_by_direction": 0.09}
    for place in places - set(signs):
        assert first[place] != second[place]
    for place, size in signs.items():
        assert {drawn_settings(scenario, seed)[place] for seed in range(12)} == {-size, size}
    loads = [drawn_settings(scenario, seed)["plant.errors.load_friction"] for seed in range(60)]
    # Sixty uniform numbers from 0 to 0.1 leave the outer twentieths empty once in twenty times; the seeds are fixed.
    assert 0.0 < min(loads) < 0.01
    assert 0.09 < max(loads) < 0.1


def test_where_friction_drifts_both_kinds_do_by_two_percent_of_their_own_and_nothing_else_is_drawn():
    scenario = load_scenario("drift")
    check_draws(scenario, bench)
    drawn = [drawn_settings(scenario, seed) for seed in range(200)]
    places = ("plant.errors.coulomb_drift", "plant.errors.viscous_drift")
    assert all(set(settings) == set(places) for settings in drawn)
    values = np.array([[settings[place] for place in places] for settings in drawn])
    # Two hundred draws know a deviation to 5 %, a correlation to 0.07, a mean to 0.0014; three of these.
    np.testing.assert_allclose(values.std(axis=0), 0.02, rtol=0.15)
    assert np.abs(values.mean(axis=0)).max() < 0.0042
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.21
    assert [motion.loaded for motion in bench(scenario).experiments] == [False, True]


@pytest.mark.parametrize("name", ["field", "field-two-weights"])
def test_in_the_field_a_payload_is_believed_with_the_deviations_that_it_is_drawn_with(name):
    scenario = load_scenario(name)
    prepared = bench(scenario)
    for mounting, believed in prepared.payloads.items():
        place = "plant.payload" if mounting == "loaded" else f"plant.payloads.{mounting}"
        true = value_at(prepared.scenario.table, f"{place}.mass")
        assert (believed.mass, believed.mass_std) == (true, scenario.table.random["payload mass"].parameters["scale"])
        assert believed.com == tuple(value_at(prepared.scenario.table, f"{place}.com"))
        assert believed.com_std == (scenario.table.random["payload centre"].parameters["scale"],) * 3
        share = scenario.table.random["payload inertia"].parameters["scale"]
        inertia, std = np.array(believed.inertia[:3]), np.array(believed.inertia_std[:3])
        for key, value in zip(("ixx", "iyy", "izz"), inertia, strict=True):
            assert value == value_at(prepared.scenario.table, f"{place}.inertia.{key}")
        np.testing.assert_allclose(std, share * inertia, rtol=0.02)  # two digits are stated


@pytest.mark.parametrize("name", ["field", "field-two-weights"])
def test_the_error_budget_in_the_field_switches_the_payloads_that_are_mounted(name):
    sources = sources_of(load_scenario(name))
    on = settings_with(sources, {"payload mass": np.full(sources.width["payload mass"], 0.9)}).settings
    masses = {place: value for place, value in on.items() if place.endswith(".mass")}
    expected = (
        {"plant.payload.mass": 7.025}
        if name == "field"
        else {"plant.payloads.light.mass": 4.275, "plant.payloads.heavy.mass": 7.025}
    )
    assert set(masses) == set(expected)
    for place, value in masses.items():
        # The 90th percentile of 25 g, from a table of the normal distribution.
        np.testing.assert_allclose(value - expected[place], 1.2816 * 0.025, rtol=1e-4)
