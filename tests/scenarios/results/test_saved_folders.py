import json
import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import page_folders
import pytest

from ident.diagnosis.diagnosis import Diagnosis
from ident.estimation.estimators import estimator
from ident.estimation.problem import ObservedMotion
from ident.preparation import SIMULATED, prepare
from ident.recordings.files import read_recording
from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario
from scenarios.rendering.content import Line, Mood, Paragraph, Picture, Report, Table
from scenarios.rendering.plot import Plot
from scenarios.rendering.wording import joints_named
from scenarios.results.diagnoses import TOGETHER
from scenarios.results.fit import begins, fit_of, fit_rows, read_fit
from scenarios.results.gains import Result
from scenarios.results.pages import kind_of, page_of, with_picture
from scenarios.results.record import read_record, read_result, recorded_problem
from scenarios.results.run_folder import scene_digest


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return page_folders.run(tmp_path_factory.mktemp("run"))


@pytest.fixture
def copied(saved, tmp_path):
    return shutil.copytree(saved, tmp_path / "copied")


@pytest.fixture(scope="module")
def again(saved):
    """Logs and estimate of the run, from its folder."""
    given = recorded_problem(saved, read_record(saved))
    prepared = prepare(given.motions, given.arm, observing=given.observing, gains=given.gains, policy=SIMULATED)
    method = estimator("ls-2011")
    return prepared, method.estimate(prepared.problem, method.options())


def test_the_rows_of_a_run_are_saved_as_they_were_found(saved, again):
    prepared, estimate = again
    found, fit = fit_of(prepared, estimate), read_fit(saved)
    gains = read_result(saved, Result).gains
    assert [each.joint for each in gains if each.estimate is None] == [4, 6]
    assert [each - 1 for each in fit.still] == sorted(estimate.solution.rows.unknowns)
    for name in ("joint", "motion"):
        np.testing.assert_array_equal(getattr(fit, name), getattr(found, name))
    for name, column in found.rows.items():  # the arm is read from its minimal model, whose numbers are rounded
        np.testing.assert_allclose(fit.rows[name], column, rtol=1e-9, atol=1e-9)
    for here, there in zip(fit.still.values(), found.still.values(), strict=True):
        np.testing.assert_allclose(here, there, rtol=1e-9, atol=1e-9)
    assert fit.begins == found.begins
    assert [[each.joint for each in log.joints] for log in fit.motions] == [[1, 2, 3, 4, 5, 6]] * 2
    for joint, gain in enumerate(gains):
        share = estimate.residual_share(joint)
        assert gain.residual_share == (None if share is None else pytest.approx(share, rel=1e-9))


def test_rows_lie_on_the_axis_of_time_as_far_apart_as_in_their_logs(again):
    prepared, estimate = again
    bare, heavy = prepared.problem.motions  # of which the clock of one does not begin at zero
    joints = tuple(replace(each, t=each.t + 1200.25) for each in heavy.observation.joints)
    later = ObservedMotion(replace(heavy.observation, joints=joints), heavy.payload)
    problem, logs = replace(prepared.problem, motions=(bare, later)), [motion.recording for motion in prepared.motions]
    logs[1] = replace(logs[1], t=logs[1].t + 1200.25)
    start = begins(logs)
    assert start[0] == 0.0
    motion, rows, removed = fit_rows(problem, estimate, 1, logs)
    own = estimate.solution.rows.of(1)
    np.testing.assert_array_equal(rows["v"], estimate.solution.rows.V[own])
    np.testing.assert_array_equal(rows["residual"], estimate.solution.rows.residual[own])
    seen = [motion.observation for motion in problem.motions]
    for k, observed in enumerate(seen):
        # Rows of a motion are as far from each other on the page as in the log, and lie inside it.
        t, log, behind = rows["t"][motion == k], logs[k], observed.full_rate
        np.testing.assert_array_equal(rows["time"][motion == k], observed.joints[1].t)
        np.testing.assert_allclose(t - start[k], observed.joints[1].t - log.t[0], rtol=0, atol=1e-9)  # rounding
        assert start[k] < t[0] < t[-1] < start[k + 1]
        still = [(a, b) for a, b in removed if start[k] <= a < start[k + 1]]
        shaded = sum(b - a for a, b in still) / behind.period
        assert round(shaded) == int((~behind.moving[:, 1]).sum())
        # Where the shading ends, the joint has just passed the speed below which samples are left out.
        first = (behind.edge + 0.5 * (behind.group - 1)) * log.period  # of the filtered samples, since the log began
        edge = round((still[0][1] - start[k] - first) / behind.period)
        assert behind.moving[edge, 1]
        assert not behind.moving[edge - 1, 1]


def test_a_page_is_drawn_from_what_was_saved_and_identifies_nothing(saved, monkeypatch):
    for name in ("ident.identification.prepare", "ident.preparation.examined", "ident.preparation.prepare"):
        monkeypatch.setattr(name, None)
    plots = [part for part in page_of(saved).parts if isinstance(part, Plot) and part.wide]
    fit, gains = read_fit(saved), read_result(saved, Result).gains
    assert len(plots) == len(fit.still) == 6
    for joint, label, scale in ((2, "Torque [N m]", gains[1].estimate), (4, "Current [drive units]", 1.0)):
        above, below = plots[joint - 1].figure().axes
        for axes, name in ((above, "v"), (below, "residual")):
            shown = axes.lines[0].get_ydata()
            np.testing.assert_array_equal(shown[np.isfinite(shown)], scale * fit.rows[name][fit.joint == joint])
        assert above.get_ylabel() == label
        assert len(above.patches) == len(fit.still[joint]) > 0
    assert [line.get_xdata()[0] for line in above.lines[2:]] == list(fit.begins[:2])


def test_identified_logs_are_saved_with_all_that_it_takes(saved, tmp_path, monkeypatch):
    late = (6.8e-3, Diagnosis(name="delay", sentence="the currents are logged late"))
    monkeypatch.setattr("ident.preparation.common_delay", lambda _: late)
    folder = page_folders.identification(tmp_path / "again", saved, "--current-delay", "auto")
    report = page_of(folder)
    assert report.title == "Drive gains of rx90 by ls-2011"
    observing = recorded_problem(folder, read_record(folder)).observing
    assert (observing.cutoff_hz, observing.current_delay) == (14.0, -6.8e-3)
    assert [motion.log for motion in read_fit(folder).motions] == page_folders.logs(saved)
    table = next(part for part in report.parts if isinstance(part, Table))
    for gain, row in zip(read_result(folder, Result).gains, table.rows, strict=True):
        assert row[7].text == f"{100 * gain.residual_share:.1f}"
    assert report.parts[0].text.startswith("4 of 6 gains identified, ±")
    assert report.parts[0].strong
    again = [part.text for part in report.parts if isinstance(part, Line)][1]
    assert "--cutoff-hz 14.0" in again
    assert "delay=-0.0068" in again


def test_bare_motions_from_their_folder_say_the_same(saved, tmp_path, monkeypatch):
    sheet = tmp_path / "sheet.toml"
    known = "\n".join(f'[[gains]]\njoint = {j}\nname = "joint{j}"\nestimate = 1.1\nstd = 0.1\n' for j in range(1, 7))
    sheet.write_text(known)
    words = ["--model", str(saved / "robot.xml"), "--unloaded", str(saved / "unloaded.parquet"), "--max-rel-std", "0.5"]
    words += ["--option", "friction=viscous-coulomb", "--gains", str(sheet)]
    folder = tmp_path / "new"
    assert main(["identify", *words, "--save", str(folder)]) == 0
    assert kind_of(folder) == "bare"
    sheet.unlink()
    report = page_of(folder)
    told = json.loads((folder / "result.json").read_text())
    reference = told["reference"]
    given = {k: each["ratio"] is not None for k, each in enumerate(told["joints"], 1) if k != reference}
    assert set(given.values()) == {True, False}
    assert (told["consistent"], "without link masses" in told["consistent_reason"]) == (None, True)  # a folder's model
    found, refused = ([k for k in given if given[k] is wanted] for wanted in (True, False))
    ratios = next(part for part in report.parts if isinstance(part, Table))
    verdicts = {k: row[-1].text for k, row in enumerate(ratios.rows, 1)}
    assert verdicts == {k: {True: "identified", False: "refused"}[given[k]] for k in given} | {reference: "reference"}
    spread = sorted(200.0 * told["joints"][k - 1]["rel_std"] for k in found)
    texts = [part.text for part in report.parts if isinstance(part, Paragraph)]
    for words in (joints_named(found), joints_named(refused), f"{spread[0]:.2g} to {spread[-1]:.2g} %"):
        assert words in texts[0]
    assert all((f"Joint {k}: {told['joints'][k - 1]['reason']}." in texts) != given[k] for k in given)
    again = shlex.split([part.text for part in report.parts if isinstance(part, Line)][1])
    for option, value in (("--gains", folder / "gains.toml"), ("--unloaded", folder / "motion-1.parquet")):
        assert again[again.index(option) + 1] == str(value)
    assert again[again.index("--option") + 1] == "friction=viscous-coulomb"
    assert {"gains.toml", "result.json"} < set(read_record(folder).files)
    assert report.parts[0].mood is Mood.PLAIN
    monkeypatch.setattr("scenarios.results.bare.prediction_warnings", lambda predicted: ["joint 2 is badly predicted"])
    verdict = page_of(folder).parts[0]
    assert (verdict.mood, verdict.text.endswith("See the warnings below.")) == (Mood.DOUBTFUL, True)


def test_the_page_of_a_check_says_what_it_said(saved, tmp_path):
    coupled = ["--coupling", "5", "6"]
    folder = page_folders.check(tmp_path / "checked", saved, "--loaded", str(saved / "loaded.parquet"), *coupled)
    assert read_record(folder).robot.couplings == ((5, 6),)
    report, told = page_of(folder), json.loads((folder / "result.json").read_text())
    assert report.title.startswith({"good": "GOOD, ", "weak": "USABLE, ", "wrong": "WRONG: "}[told["verdict"]])
    record = read_record(folder)
    day, time = record.created[:16].split("T")
    assert Paragraph(f"From {', '.join(record.sources)}; made {day} {time} UTC.") in report.parts[:5]
    tables = [part for part in report.parts if isinstance(part, Table) and part.columns[-1].title == "Found"]
    found = told["diagnoses"]
    shown = {table.title: [row[2].text for row in table.rows] for table in tables}
    logs = [", ".join(Path(log).name for log in x["logs"]) or TOGETHER for x in found]
    own = {name: [x["sentence"] for x, of in zip(found, logs, strict=True) if of == name] for name in shown}
    assert (shown, sum(map(len, shown.values()))) == (own, len(found))
    currents = [part for part in report.parts if isinstance(part, Plot) and part.wide]
    assert len(currents) == 12
    v = read_recording(saved / "unloaded.parquet").v[:, 2]
    # The lowest and the highest sample of all are drawn, however few of the others are.
    shown = currents[2].figure().axes[0].lines[0].get_ydata()
    assert (shown.min(), shown.max()) == (v.min(), v.max())
    assert len(shown) < 0.3 * len(v)
    words = shlex.split([part.text for part in report.parts if isinstance(part, Line)][1])
    assert words[:3] == ["rx90", "check", str(folder / "robot.xml")]
    assert words[words.index("--coupling") :][:3] == coupled
    loaded = [str(folder / "motion-2.parquet"), "--payload", str(folder / "payload.toml")]
    assert words[words.index("--loaded") + 1 :][:3] == loaded


def removed(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def without_rows(folder: Path) -> None:
    """As an older version leaves it."""
    record = json.loads((folder / "record.json").read_text())
    del record["files"]["fit-rows.parquet"], record["digest"]
    (folder / "record.json").write_text(json.dumps(record))
    (folder / "fit-rows.parquet").unlink()


def edited(folder: Path) -> None:
    text = (folder / "record.json").read_text()
    (folder / "record.json").write_text(text.replace('"title": "Scenario', '"title": "scenario'))


def replaced(name: str, text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_text(text) and None


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (removed("record.json"), "contains no whole result"),
        (replaced("record.json", "{"), "record.json: not JSON"),
        (replaced("record.json", '{"kind": "dream"}'), "states kind 'dream'"),
        (replaced("record.json", '{"kind": "run"}'), "save it again"),
        (removed("loaded.parquet"), "loaded.parquet: No such file"),
        (replaced("fit-rows.parquet", "PAR1"), "fit-rows.parquet: is not the file that record.json names"),
        (edited, "record.json: changed or damaged since it was written"),
        (without_rows, "fit-rows.parquet: not rows of this version of rx90: "),
        (shutil.rmtree, "not a folder"),
        (
            lambda folder: [path.unlink() for path in folder.iterdir()],
            "contains no whole result of this version; expected a folder written",
        ),
    ],
)
def test_what_is_no_whole_result_of_this_version_is_refused_in_one_line(spoil, said, copied, capsys):
    spoil(copied)
    capsys.readouterr()
    assert main(["report", str(copied), "--out", str(copied.parent / "out.html")]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not (copied.parent / "out.html").exists()


def test_an_arm_that_is_another_since_it_was_run_is_not_shown(copied, monkeypatch):
    report = Report("Title", (Paragraph("verdict"), Paragraph("rest")), {})
    record, picture = json.loads((copied / "record.json").read_text()), Picture("the arm", b"PNG")
    monkeypatch.setattr("scenarios.results.pages.still", lambda named: picture)
    assert with_picture(report, copied).parts == (report.parts[0], picture, report.parts[1])
    scenario = load_scenario(record["scenario"])
    heavier = scenario.table.plant.model_copy(update={"gain": tuple(1.5 + 0.25 * k for k in range(6))})
    other = replace(scenario, table=scenario.table.model_copy(update={"plant": heavier}))
    assert scene_digest(scenario) == record["scene"] != scene_digest(other)
    for key, value in (("scene", "0123456789abcdef"), ("scene", None), ("scenario", "no-such")):
        (copied / "record.json").write_text(json.dumps({**record, key: value}))
        assert with_picture(report, copied) is report
