"""`rx90 scoreboard`: recordings in the formats of its recipes, written here, and the real ones where they are."""

import json
import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from bad_files import only_line
from bags import Sample, write_bag
from printed import fits, printed
from weighed_cell import MODEL

import scenarios.benchmark.scoreboard.board as scoreboard_module
from ident.estimation.known_gains import KnownGains
from ident.model.arm import load_arm
from ident.model.regressor import regressor
from ident.payload.payload import Payload
from ident.payload_identification.payload_estimate import FoundPayload
from ident.payload_identification.verification import Verification, verified
from ident.support.errors import NotIdentifiable
from scenarios.benchmark.methods.answers import AnswerGain, AnswerRow
from scenarios.benchmark.scoreboard.board import _agreements, _Ready, _refusals
from scenarios.benchmark.scoreboard.recipes import RECIPES, SetTable, recipes
from scenarios.benchmark.scoreboard.results import Entry, Scoreboard
from scenarios.cli import main
from scenarios.reports.content import Heading, Table
from scenarios.reports.scoreboard import scoreboard_report

WRONG, RIGHT = "method_stubs:constant", "ls-2011"
MISSING = "Missing recordings, and how to get them"
UR = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]


def board(capsys, folder: Path, out: Path, *more: str, status: int = 0) -> dict[str, dict]:
    """The entries of a folder by the recipe's name."""
    assert main(["scoreboard", str(folder), "--out", str(out), "--json", *more]) == status
    return {each["name"].partition(",")[0]: each for each in printed(capsys, "scoreboard")["entries"]}


@pytest.fixture(scope="module")
def cells(weighed_cell, tmp_path_factory) -> Path:
    """Two cells with other noise, and a recipe of both: gains that are published are 1.1 times the true ones."""
    folder = tmp_path_factory.mktemp("board")
    main(["run", str(weighed_cell / "quick.toml"), "--seed", "7", "--save", str(folder / "b")])
    (folder / "a").symlink_to(weighed_cell / "run")
    true = [each["true"] for each in json.loads((folder / "b" / "result.json").read_text())["gains"]]
    sets = [
        f'[[set]]\nname = "{name}"\nbare = ["{cell}/unloaded.parquet"]\nloaded = ["{cell}/{which}.parquet"]\n'
        f'payload = "{cell}/payload-{which}.toml"\n'
        for name, cell, which in (("first", "a", "heavy"), ("second", "b", "light"))
    ]
    sets.append('[[set]]\nname = "alone"\nbare = ["b/unloaded.parquet"]\n')
    stated = f'name = "Cells"\nsource = "here"\nlicence = "none"\nget = "it is there"\nmodel = "{MODEL}"\n'
    published = f'published = {[1.1 * each for each in true]}\npublished_by = "nobody"\n'
    (folder / "cells.toml").write_text(stated + published + "".join(sets))
    return folder


@pytest.fixture(scope="module")
def played(cells, tmp_path_factory) -> tuple[dict, Path]:
    """The entry of the cells with a method that is right and one that is wrong, and the folder that was written.

    No mass is identified with the gains of the wrong one, as if they were too few.
    """
    out = tmp_path_factory.mktemp("out")
    more = ["--recipe", str(cells / "cells.toml"), "--method", RIGHT, "--method", WRONG]

    def weighed(found: FoundPayload, payload: Payload, gains: KnownGains) -> Verification:
        if (gains.value == gains.value[0]).all():
            raise NotIdentifiable("too few")
        return verified(found, payload, gains)

    with redirect_stdout(StringIO()) as said, pytest.MonkeyPatch.context() as patch:
        patch.setattr(scoreboard_module, "verified", weighed)
        assert main(["scoreboard", str(cells), "--out", str(out / "out"), "--json", *more]) == 1
    told = json.loads(said.getvalue())
    fits(told, "scoreboard")
    return next(each for each in told["entries"] if each["name"] == "Cells"), out / "out"


def test_methods_are_held_against_published_gains_each_other_and_what_no_data_give(played):
    found, _ = played
    assert found["status"] == "run"
    third = {(each["set"], each["method"]): each for each in found["gains"] if each["joint"] == 3}
    gain = third["first", RIGHT]
    assert gain["rel_difference"] == pytest.approx(gain["gain"] / gain["published"] - 1.0, rel=1e-12)
    assert abs(gain["rel_difference"] - (1.0 / 1.1 - 1.0)) < 4.0 * gain["std"] / gain["published"]
    assert third["alone", RIGHT]["gain"] is None
    refusals = {each["method"]: each for each in found["refusals"]}
    assert (refusals[RIGHT]["right"], refusals[RIGHT]["wrong"]) == (6, 0)
    assert (refusals[WRONG]["right"], refusals[WRONG]["wrong"], refusals[WRONG]["given"]) == (0, 6, 18)
    # `alone` is weighed by nobody: one pair shares no recording.
    agreed = {each["method"]: each for each in found["agreements"]}
    assert agreed[WRONG] | {"joints": 6, "within": 6, "largest": 0.0, "sets": ["first", "second"]} == agreed[WRONG]
    assert 0 < agreed[RIGHT]["joints"] < 6
    assert agreed[RIGHT]["within"] >= agreed[RIGHT]["joints"] - 1


def test_gains_predict_and_weigh_what_they_have_not_seen(played):
    found, out = played
    logs = {(each["set"], each["log"]) for each in found["predictions"]}
    files = {"first": {"b/unloaded.parquet", "b/light.parquet"}, "second": {"a/unloaded.parquet", "a/heavy.parquet"}}
    files["alone"] = {"a/unloaded.parquet", "a/heavy.parquet", "b/light.parquet"}
    assert logs == {(name, log) for name, own in files.items() for log in own}
    weights = {(each["gains"], each["set"]): each for each in found["weights"]}
    assert set(weights) == {(gains, name) for gains in (RIGHT, "published") for name in ("first", "second")}
    assert all(each["gains_set"] != each["set"] for each in found["weights"])
    assert {each["gains_set"] for each in found["weights"]} == {"first", "second", None}
    for (gains, of), each in weights.items():
        assert each["mass"] == {"first": 7.025, "second": 4.275}[of]
        expected = 1.1 if gains == "published" else 1.0
        assert abs(each["found"] / each["mass"] - expected) < 4.0 * each["std"] / each["mass"]
    page = (out / "scoreboard.html").read_text(encoding="utf-8")
    assert "Payloads estimated with gains that were identified without them" in page
    assert "untried" in page


def answers(name: str, bare: str, loaded: str | None, *gains: tuple[float | None, float | None]) -> _Ready:
    """A set of one bare and perhaps one loaded recording, and what a method answered."""
    weighed = {} if loaded is None else {"loaded": (loaded,), "payload": "payload.toml"}
    said = [
        AnswerGain(joint=j, estimate=value, std=std, identifiable=value is not None)
        for j, (value, std) in enumerate(gains, 1)
    ]
    row = AnswerRow(problem=name, digest="0" * 64, method="mine", files={}, seconds=0.7, gains=said)
    return _Ready(table=SetTable(name=name, bare=(bare,), **weighed), motions=(), rows=(row,))


def test_sets_that_share_no_recording_are_compared_by_gains_that_both_have():
    one = answers("one", "a", "b", (2.0, 0.1), (3.0, 0.2), (None, None), (5.0, None))
    other = answers("other", "c", "d", (2.2, 0.05), (3.9, 0.2), (7.0, 0.1), (5.0, 0.1))
    same_bare = answers("same bare", "a", "e", (2.0, 0.1), (3.0, 0.2), (7.3, 0.2), (5.5, 0.1))
    unweighed = answers("unweighed", "f", None, (None, None), (3.0, 0.2), (None, None), (None, None))
    found = list(_agreements([one, other, same_bare, unweighed], "mine"))
    assert [each.sets for each in found] == [("one", "other"), ("other", "same bare")]
    assert (found[0].joints, found[0].within) == (2, 1)  # 0.2 of 0.112, 0.9 of 0.283
    np.testing.assert_allclose(found[0].largest, 1.0 - 3.0 / 3.9, rtol=1e-12)


def test_gains_without_a_payload_are_wrong_and_refusals_right():
    sets = [
        answers("weighed", "a", "b", (2.0, 0.1), (3.0, 0.2), (None, None), (5.0, 0.1), (6.0, 0.1)),
        answers("bare", "c", None, (2.0, 0.1), (None, None), (None, None), (None, None), (None, None)),
    ]
    found = _refusals(sets, "mine")
    assert (found.given, found.refused, found.right, found.wrong, found.failed) == (5, 5, 4, 1, 0)
    assert found.seconds == 1.4


def test_the_report_adds_up_each_method_and_tells_what_is_missing(played):
    entry = Entry.model_validate(played[0])
    missing = entry.model_copy(update={"name": "Elsewhere", "status": "missing", "missing": ["there.csv"]})
    report = scoreboard_report(Scoreboard(folder="here", methods=[RIGHT, WRONG], entries=[entry, missing]))
    assert [part.text for part in report.parts if isinstance(part, Heading)] == ["Cells", MISSING]
    tables = {part.title: part for part in report.parts if isinstance(part, Table)}
    _, wrong = tables["Methods, all recordings together"].rows
    assert [cell.text for cell in wrong[:7]] == [WRONG, "18", "0", "0", "6", "6", "6"]
    gains = [[row[k].text for k in (0, 1, 2)] for row in tables["Gains"].rows]
    assert gains == [[each.set, each.method, str(each.joint)] for each in entry.gains if each.gain is not None]
    weights = "Payloads estimated with gains that were identified without them"
    for title, numbers in (
        ("Currents of recordings that were not used in any fit", ["Error"]),
        (weights, ["Weighed", "Estimate", "2 sigma", "Error"]),
    ):
        assert [column.title for column in tables[title].columns if not column.words] == numbers
    alone = scoreboard_report(Scoreboard(folder="here", methods=[RIGHT, WRONG], entries=[entry]))
    assert MISSING not in [part.text for part in alone.parts if isinstance(part, Heading)]


def test_a_set_whose_files_are_swapped_is_not_usable_and_wrong_gains_alone_are_a_number(cells, tmp_path, capsys):
    text = (cells / "cells.toml").read_text().partition('[[set]]\nname = "alone"')[0]  # two pairs are enough
    swapped = text.replace('["a/heavy', '["x').replace('["a/unloaded', '["a/heavy').replace('["x', '["a/unloaded')
    (tmp_path / "swapped.toml").write_text(swapped)
    words = ["--method", RIGHT]
    found = board(capsys, cells, tmp_path / "one", "--recipe", str(tmp_path / "swapped.toml"), *words, status=1)[
        "Cells"
    ]
    assert found["status"] == "unusable"
    assert re.search(
        r"set first: the estimated mass is negative: -[\d.]+ kg, 2 sigma .* probably swapped", found["reason"]
    )
    (tmp_path / "turned.toml").write_text(
        re.sub(r"published = \[(.*)\]", r"published = [-2, -2, -2, -2, -2, -2]", text)
    )
    found = board(capsys, cells, tmp_path / "two", "--recipe", str(tmp_path / "turned.toml"), *words)["Cells"]
    assert found["status"] == "run"
    negative = {each["gains"]: each["found"] < 0.0 for each in found["weights"]}
    assert negative == {RIGHT: False, "published": True}


def test_what_is_missing_is_told_with_how_to_get_it(tmp_path, capsys):
    (tmp_path / "nothing").mkdir()
    found = board(capsys, tmp_path / "nothing", tmp_path / "out", status=1)
    assert len(found) == len(list(RECIPES.glob("*.toml")))
    assert {each["status"] for each in found.values()} == {"missing"}
    assert all(each["get"] and each["source"] and each["licence"] for each in found.values())
    assert {name for name, each in found.items() if each["untried"]} == {"EMPS", "FactoryNet"}
    assert main(["scoreboard", str(tmp_path / "nothing"), "--out", str(tmp_path / "out"), "--force"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "0 of 6 recordings run" in said
    assert "ur10/exciting.db3. Clone the repository" in said
    assert "EMPS, an electro-mechanical slide (untried: this project has not read any file of this format)" in said


def test_no_data_are_in_the_catalogue():
    assert {path.suffix for path in RECIPES.iterdir()} == {".toml", ".urdf"}
    assert all(each.model is None or RECIPES in each.place(each.model, Path("x")).parents for each in recipes())


def waves(t: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smooth motion of n joints, with two derivatives."""
    j = np.arange(n)
    w = 2.0 * np.pi * (0.17 + 0.043 * j), 2.0 * np.pi * (0.41 - 0.037 * j)
    angles = [each * t[:, None] + 0.7 * j for each in w]
    q = 0.7 * np.sin(angles[0]) + 0.2 * np.cos(angles[1]) - np.array([0.0, 1.4, 0.0, 0.0, 0.0, 0.0])[:n]
    dq = 0.7 * w[0] * np.cos(angles[0]) - 0.2 * w[1] * np.sin(angles[1])
    return q, dq, -0.7 * w[0] ** 2 * np.sin(angles[0]) - 0.2 * w[1] ** 2 * np.cos(angles[1])


def test_a_bag_of_a_ur10_gives_ratios_and_no_gain(tmp_path, capsys):
    t = 100.0 + 0.008 * np.arange(3000)
    q, dq, ddq = waves(t, 6)
    rng = np.random.default_rng(4)
    arm = load_arm(RECIPES / "ur10.urdf")
    chi = np.tile([0.3, 0.01, -0.02, 0.4, 0.02, 0.2, -1.3, 0.2, 0.3, 4.0, 0.5, 9.0, 6.0, 0.2], 6)
    tau = regressor(arm, q, dq, ddq) @ chi
    gain = np.array([1.0, 1.0, 1.25, 1.0, 1.0, 1.0])  # joint 3 gives more torque than is logged
    effort = tau / gain
    effort += 0.005 * np.std(effort, axis=0) * rng.standard_normal(effort.shape)
    names = [f"{name}_joint" for name in UR]
    order = rng.permutation(6)  # a driver's order is its own
    samples = [
        Sample(stamp=time, names=[names[j] for j in order], position=position[order], effort=torque[order])
        for time, position, torque in zip(t, q, effort, strict=True)
    ]
    bag = write_bag(tmp_path / "bag", samples)
    (tmp_path / "ur10").mkdir()
    next(bag.glob("*.db3")).rename(tmp_path / "ur10" / "exciting.db3")
    found = board(capsys, tmp_path, tmp_path / "out", "--method", RIGHT)["UR10 of the inverse dynamics solver"]
    assert found["status"] == "run"
    assert found["refusals"][0]["right"] == 6
    for each in found["ratios"]:
        if each["joint"] != each["reference"]:
            expected = gain[each["joint"] - 1] / gain[each["reference"] - 1]
            assert abs(each["ratio"] / expected - 1.0) < max(4.0 * each["rel_std"], 0.02)
            assert each["rel_difference"] == pytest.approx(each["ratio"] - 1.0, rel=1e-9)


def test_a_slide_without_a_payload_has_no_gain(tmp_path, capsys):
    t = 0.001 * np.arange(8000)
    (tmp_path / "emps").mkdir()
    rng = np.random.default_rng(5)
    for name, pace in (("estimation", 1.0), ("pulses", 1.3)):
        q, dq, ddq = (pace**k * each for k, each in enumerate(waves(pace * t, 1)))
        vir = (95.0 * ddq + 200.0 * dq + 20.0 * np.sign(dq)) / 35.15 + 0.01 * rng.standard_normal(q.shape)
        np.savez(tmp_path / "emps" / f"{name}.npz", t=t, qm=q[:, 0], vir=vir[:, 0])
    found = board(capsys, tmp_path, tmp_path / "out", "--method", RIGHT)["EMPS"]
    assert (found["status"], found["untried"]) == ("run", True)
    assert found["refusals"][0]["right"] == 2
    assert any("no ratios of gains" in note for note in found["notes"])
    predicted = {(each["set"], each["log"]): each["rel_error"] for each in found["predictions"]}
    assert set(predicted) == {("estimation", "emps/pulses.npz"), ("pulses", "emps/estimation.npz")}
    assert max(predicted.values()) < 0.02  # noise of 0.01 V beside some volts


def test_torque_sensors_are_held_against_motors(tmp_path, capsys):
    rng = np.random.default_rng(6)
    columns = dict[str, np.ndarray]()
    for j in range(1, 7):
        motor, dq = 20.0 * rng.standard_normal((2, 400))
        sensor = 0.1 * j * motor - 0.3 * dq - 2.0 * np.sign(dq) + 0.5
        noise = [0.01, 300.0 if j == 6 else 0.01]  # the second sensor of the last joint shows nothing
        columns |= {f"motor_torque_{j}": motor, f"joint_velocity_{j}": dq}
        for name, size in zip("ab", noise, strict=True):
            columns[f"torque_sensor_{name}_{j}"] = sensor + size * rng.standard_normal(400)
    (tmp_path / "voraus").mkdir()
    pq.write_table(pa.table(columns), tmp_path / "voraus" / "sample.parquet")
    found = board(capsys, tmp_path, tmp_path / "out")["voraus-AD"]["sensors"]
    slopes = {each["sensor"]: each["slope"] for each in found}
    np.testing.assert_allclose([slopes[f"torque_sensor_a_{j}"] for j in range(1, 7)], 0.1 * np.arange(1, 7), rtol=1e-3)
    assert slopes["torque_sensor_b_6"] is None
    columns["torque_sensor_b_3"] *= 1.3
    pq.write_table(pa.table(columns), tmp_path / "voraus" / "sample.parquet")
    notes = board(capsys, tmp_path, tmp_path / "out", "--force")["voraus-AD"]["notes"]
    assert notes == [
        "joint 3: torque_sensor_b_3 differs from torque_sensor_a_3 by +30 %; at most one can be its torque"
    ]
    del columns["joint_velocity_4"]
    pq.write_table(pa.table(columns), tmp_path / "voraus" / "sample.parquet")
    found = board(capsys, tmp_path, tmp_path / "out", "--force", status=1)["voraus-AD"]
    assert found["status"] == "unusable"
    assert "no column joint_velocity_4" in found["reason"]


def test_a_scoreboard_is_not_written_into_the_folder_of_a_run(cells, tmp_path, capsys):
    before = sorted(path.name for path in (cells / "b").iterdir())
    assert main(["scoreboard", str(tmp_path), "--out", str(cells / "b"), "--force"]) == 2
    assert "rx90 run --save wrote into this folder; give another one" in only_line(capsys)
    assert sorted(path.name for path in (cells / "b").iterdir()) == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nome = 3", "recipe"),
        ('[[set]]\nname = "a"\nbare = ["b.csv"]\nloaded = ["c.csv"]', "set a: loaded and payload go together"),
        ('[log]\nsignal = "volts"', "signal = 'volts'"),
    ],
)
def test_a_recipe_that_cannot_be_meant_is_one_line(tmp_path, capsys, text, message):
    stated = 'name = "x"\nsource = "s"\nlicence = "l"\nget = "g"\nmodel = "m.urdf"\n'
    (tmp_path / "x.toml").write_text(stated + text)
    assert main(["scoreboard", str(tmp_path), "--out", str(tmp_path / "o"), "--recipe", str(tmp_path / "x.toml")]) == 2
    assert message in only_line(capsys)


@pytest.mark.real
@pytest.mark.slow
def test_real_recordings_agree_and_are_weighed(real, tmp_path, capsys):
    found = board(capsys, real, tmp_path / "out")
    assert {name for name, each in found.items() if each["status"] == "run"} >= {"UR10e", "UR10 of the inverse "
    "dynamics solver", "TX-40", "voraus-AD"}  # fmt: skip
    agreed = [each for each in found["UR10e"]["agreements"] if each["method"] == "nls"]
    assert sum(each["joints"] for each in agreed) == 12
    assert sum(each["within"] for each in agreed) >= 10  # an honest interval of 95 % gives fewer once in 50 boards
    nls, published = (
        [abs(each["found"] / each["mass"] - 1.0) for each in found["UR10e"]["weights"] if each["gains"] == name]
        for name in ("nls", "published")
    )
    assert max(nls) < 0.04  # 0.1 to 3.2 %
    assert np.mean(published) > 2.0 * np.mean(nls)
    assert not any(each["wrong"] for entry in found.values() for each in entry["refusals"])
