"""Pages from folders: what is identified again, which folders are refused."""

import json
import math
import shlex
import shutil

import numpy as np
import page_folders
import pytest
from page_parts import Elements, identified

from ident.estimate import RefusedGain
from scenarios.again import differences, identified_again
from scenarios.cli import main
from scenarios.errors import DamagedResult, ForeignResult, UnfinishedResult
from scenarios.reports.content import (
    Heading,
    Line,
    Mood,
    Paragraph,
    Report,
    Table,
)
from scenarios.reports.pages import kind_of, page_of
from scenarios.reports.pages.fit_rows import begins, fit_rows
from scenarios.reports.pages.gain_plots import error_plot
from scenarios.reports.pages.monte_carlo import NORMAL
from scenarios.reports.pages.paper import same
from scenarios.reports.pages.still import with_picture
from scenarios.reports.plot import Plot
from scenarios.store.record import digests_of


def test_results_differ_where_a_number_or_a_refusal_does():
    refused = RefusedGain(joint="b", reason="said so", predicted_rel_std=0.5)
    saved = (identified(0.9, 0.01), refused, identified(1.5, 0.02))
    assert differences(saved, saved) == ()
    close = (
        identified(0.9 * (1 + 3e-10), 0.01),
        RefusedGain(joint="b", reason="other", predicted_rel_std=None),
        saved[2],
    )
    assert differences(saved, close) == ()
    (first,) = differences(saved, (identified(0.9 * (1 + 3e-9), 0.01), *saved[1:]))
    assert first == "joint 1: 0.9 with a deviation of 0.01 was saved, now it is 0.9 with a deviation of 0.01"
    (second,) = differences(saved, (saved[0], identified(1.1, 0.03), saved[2]))
    assert second == "joint 2: a refusal was saved, now it is 1.1 with a deviation of 0.03"
    (third,) = differences(saved, (*saved[:2], identified(1.5, 0.03)))
    assert third.startswith("joint 3: ")
    assert differences(saved, saved[:2]) == ("3 joints were saved, now there are 2",)


@pytest.mark.parametrize(
    ("here", "equal"),
    [
        ({"a": [0.125, None, "x"]}, True),
        ({"a": [0.125 * (1 + 1e-7), None, "x"]}, True),
        ({"a": [0.125 * (1 + 1e-5), None, "x"]}, False),
        ({"a": [0.125, 0.0, "x"]}, False),
        ({"a": [0.125, None]}, False),
        ({"b": [0.125, None, "x"]}, False),
        ({"a": [0.125, None, "y"]}, False),
    ],
)
def test_documents_are_the_same_but_for_rounding(here, equal):
    assert same({"a": (0.125, None, "x")}, here) is equal


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return page_folders.run(tmp_path_factory.mktemp("run"))


@pytest.fixture
def copied(saved, tmp_path):
    return shutil.copytree(saved, tmp_path / "copied")


def test_a_run_identified_again_from_its_folder_is_the_same(saved):
    again = identified_again(saved)
    assert again.differences == ()
    assert [gain.estimate is None for gain in again.result.gains] == [False, False, False, True, False, True]
    evidence = again.evidence
    start = begins(evidence)
    assert start[0] == 0.0
    rows = fit_rows(evidence, 1, start)
    own = evidence.estimate.solution.rows.of(1)
    np.testing.assert_array_equal(rows.V, evidence.estimate.solution.rows.V[own])
    seen = [motion.observation for motion in evidence.problem.motions]
    for k, observed in enumerate(seen):
        # Rows of a motion are as far from each other on the page as in the log, and lie inside it.
        t = rows.t[rows.motion == k]
        behind, log = observed.full_rate, again.motions[k].recording
        first = log.t[0] + (behind.edge + 0.5 * (behind.group - 1)) * log.period  # time of the first filtered sample
        np.testing.assert_allclose(t - start[k], observed.joints[1].t - first, rtol=0, atol=1e-9)  # rounding
        assert start[k] < t[0] < t[-1] < start[k + 1]
        still = [(a, b) for a, b in rows.still if start[k] <= a < start[k + 1]]
        shaded = sum(b - a for a, b in still) / behind.period
        assert round(shaded) == int((~behind.moving[:, 1]).sum())
        # Where the shading ends, the joint has just passed the speed below which samples are left out.
        edge = round((still[0][1] - start[k]) / behind.period)
        assert behind.moving[edge, 1]
        assert not behind.moving[edge - 1, 1]
    gain = again.found.estimate.joints[1]
    assert (rows.scale, rows.unit) == (gain.value, "N m")
    assert fit_rows(evidence, 3, start).unit == "drive units"


def test_the_page_says_at_the_top_what_is_not_as_it_was_saved(copied):
    result = json.loads((copied / "result.json").read_text())
    result["gains"][2]["estimate"] *= 1.001
    (copied / "result.json").write_text(json.dumps(result))
    record = json.loads((copied / "record.json").read_text())

    record["files"] |= digests_of(copied, ["result.json"])
    (copied / "record.json").write_text(json.dumps(record))
    first, second = page_of(copied).parts[:2]
    assert first.strong
    assert second.mood is Mood.BAD
    assert "the gains are not those of result.json: joint 3: " in second.text


def test_verdict_gains_and_refusals_come_first(saved):
    report = page_of(saved)
    result = json.loads((saved / "result.json").read_text())
    headings = [part.text for part in report.parts if isinstance(part, Heading)]
    assert headings == [
        "Gains",
        "Refused or missed, and what would show it",
        "Consistency",
        "Torques, measured and reconstructed",
        "What is left: spectrum",
        "What is left, against position",
        "What is left, against speed",
        "Outliers",
        "Motion, and what it covers",
        "What was assumed",
        "To repeat it",
    ]
    assert report.document == result
    commands = [part.text for part in report.parts if isinstance(part, Line)]
    assert "run" in commands[0].split()
    plots = [part for part in report.parts if isinstance(part, Plot)]
    assert sum(plot.zoom for plot in plots) == 6
    errors = error_plot([gain.verdict for gain in identified_again(saved).result.gains])
    shown = dict(zip(errors.series[1].x, errors.series[1].y, strict=True))
    tops = dict(zip(errors.series[1].x, errors.series[1].high, strict=True))
    # The second motion is drawn behind the first.
    assert all(plot.references[1].at > 0.9 * max(plot.series[0].x) / 2 for plot in plots if plot.zoom)
    allowed = [100 * gain["tolerance"] for gain in result["gains"]]
    assert errors.series[0].high == tuple(allowed)
    assert errors.series[0].low == tuple(-each for each in allowed)
    for gain in result["gains"]:
        if gain["identifiable"]:
            half = 200 * gain["std"] / gain["true"]
            assert tops[str(gain["joint"])] == pytest.approx(100 * gain["rel_error"] + half, rel=6e-5)  # five digits
            assert shown[str(gain["joint"])] == pytest.approx(100 * gain["rel_error"], rel=6e-5)  # five digits


def test_the_commands_on_the_page_give_the_same_gains(saved, capsys):
    command = [part.text for part in page_of(saved).parts if isinstance(part, Line)][1]
    capsys.readouterr()
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    stored = json.loads((saved / "result.json").read_text())
    assert [gain["estimate"] for gain in found["gains"]] == [
        # The same files and method; the arm is read from its minimal model.
        None if gain["estimate"] is None else pytest.approx(gain["estimate"], rel=1e-9)
        for gain in stored["gains"]
    ]


def test_identified_logs_are_saved_with_all_that_it_takes(saved, tmp_path, capsys):
    folder = page_folders.identification(tmp_path / "again", saved)
    report = page_of(folder)
    assert report.title == "Drive gains of rx90 by ls-2011"
    again = identified_again(folder)
    assert again.differences == ()
    assert again.given.observing.cutoff_hz == 14.0
    assert [motion.recording.name for motion in again.motions] == [
        str(saved / "unloaded.parquet"),
        str(saved / "loaded.parquet"),
    ]
    assert report.parts[0].text.startswith("4 of 6 gains identified from ")
    assert "--cutoff-hz 14.0" in [part.text for part in report.parts if isinstance(part, Line)][1]


def test_bare_motions_from_their_folder_say_the_same(saved, tmp_path):
    sheet = tmp_path / "sheet.toml"
    known = "\n".join(f'[[gains]]\njoint = {j}\nname = "joint{j}"\nestimate = 1.1\nstd = 0.1\n' for j in range(1, 7))
    sheet.write_text(known)
    words = ["--model", str(saved / "robot.xml"), "--unloaded", str(saved / "unloaded.parquet"), "--max-rel-std", "0.5"]
    words += ["--option", "friction=viscous-coulomb", "--gains", str(sheet), "--if-loaded", str(saved / "payload.toml")]
    folder = tmp_path / "new"
    assert main(["identify", *words, "--save", str(folder)]) == 0
    assert kind_of(folder) == "bare"
    sheet.unlink()
    report = page_of(folder)
    told = json.loads((folder / "result.json").read_text())
    known = sum(each["ratio"] is not None for each in told["joints"])
    assert (told["consistent"], "without masses" in told["consistent_reason"]) == (None, True)  # a folder's model
    assert report.parts[0].text.startswith(f"Ratios of {known} of 6 gains, over that of joint {told['reference']}")
    titles = [part.title for part in report.parts if isinstance(part, Table)]
    assert any(title.startswith("If the same motions were repeated with the payload of") for title in titles)
    assert not [part for part in report.parts if isinstance(part, Paragraph) and part.mood is Mood.BAD]
    again = [part.text for part in report.parts if isinstance(part, Line)][1]
    given = shlex.split(again)
    for option in ("--gains", "--if-loaded", "--unloaded"):
        assert given[given.index(option) + 1].startswith(str(folder))
    assert "--loaded" not in given
    path = folder / "result.json"
    other = next(each for each in told["joints"] if each["ratio"] not in (None, 1.0))
    other["ratio"] *= 1.0 + 1e-7
    path.write_text(json.dumps(told))
    record = json.loads((folder / "record.json").read_text())
    record["files"] |= digests_of(folder, ["result.json"])
    (folder / "record.json").write_text(json.dumps(record))
    (said,) = [part for part in page_of(folder).parts if isinstance(part, Paragraph) and part.mood is Mood.BAD]
    assert "give other ratios than result.json" in said.text


def test_a_check_made_again_says_the_same_and_a_changed_result_is_noticed(saved, tmp_path, capsys):
    folder = page_folders.check(tmp_path / "checked", saved, "--loaded", str(saved / "loaded.parquet"))
    report = page_of(folder)
    told = json.loads((folder / "result.json").read_text())
    assert report.parts[0].text.startswith(f"{told['verdict'].upper()}: ")
    assert not any(isinstance(part, Paragraph) and "Checked again" in part.text for part in report.parts)
    table = next(part for part in report.parts if isinstance(part, Table))
    assert [row[3].text for row in table.rows] == [line["seen"] for line in told["lines"]]
    currents = [part for part in report.parts if isinstance(part, Plot) and part.zoom]
    assert len(currents) == 12
    recording = identified_again(saved).motions[0].recording
    # The lowest and the highest sample of all are drawn, however few of the others are.
    assert max(currents[2].series[0].y) == pytest.approx(recording.v[:, 2].max(), rel=6e-5)
    assert min(currents[2].series[0].y) == pytest.approx(recording.v[:, 2].min(), rel=6e-5)
    assert len(currents[2].series[0].y) < 0.2 * len(recording.t)
    words = shlex.split([part.text for part in report.parts if isinstance(part, Line)][1])
    assert words[:3] == ["rx90", "check", str(folder / "robot.xml")]
    assert words[words.index("--loaded") + 1 :][:3] == [
        str(folder / "motion-2.parquet"), "--payload", str(folder / "payload.toml")
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("spoil", "error", "said"),
    [
        (lambda folder: (folder / "record.json").unlink(), ForeignResult, "no record.json: half written, or older"),
        (lambda folder: (folder / "record.json").write_text("{"), ForeignResult, "damaged, or of another version"),
        (lambda folder: (folder / "record.json").write_text('{"kind": "dream"}'), ForeignResult, "states kind 'dream'"),
        (lambda folder: (folder / "record.json").write_text('{"kind": "run"}'), ForeignResult, "save it again"),
        (lambda folder: (folder / "loaded.parquet").unlink(), DamagedResult, "loaded.parquet: No such file"),
        (
            lambda folder: (folder / "payload.toml").write_text(""),
            DamagedResult,
            "is not the file that record.json names",
        ),
        (shutil.rmtree, ForeignResult, "is no folder"),
        (
            lambda folder: [path.unlink() for path in folder.iterdir() if path.is_file()],
            ForeignResult,
            "holds no result; expected a folder that run, identify",
        ),
    ],
)
def test_what_is_no_whole_result_of_this_version_is_refused_in_one_line(spoil, error, said, copied, capsys):
    spoil(copied)
    with pytest.raises(error) as raised:
        page_of(copied)
    assert said in str(raised.value)
    capsys.readouterr()
    assert main(["report", str(copied), "--out", str(copied.parent / "out.html")]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1
    assert not (copied.parent / "out.html").exists()


def test_studies_that_are_not_finished_or_not_whole_are_refused(tmp_path):
    folder = page_folders.study(tmp_path)
    assert kind_of(folder) == "monte-carlo"
    report = page_of(folder)
    commands = [part.text for part in report.parts if isinstance(part, Line)]
    assert commands[0].startswith("rx90 run ")
    rows = next(part for part in report.parts if isinstance(part, Table) and part.columns[0].title == "Seed").rows
    z = [abs(float(row[3].text)) for row in rows]
    assert z == sorted(z, reverse=True)
    assert f"--seed {rows[0][0].text} --save" in commands[0]
    held = next(part for part in report.parts if isinstance(part, Plot) and part.references)
    assert held.references[0].at == pytest.approx(100 * math.erf(math.sqrt(2.0)), rel=1e-12) == 100 * NORMAL
    record = json.loads((folder / "study.json").read_text())
    (folder / "study.json").write_text(json.dumps({**record, "trials": 9}))
    with pytest.raises(UnfinishedResult, match=r"3 of 9 trials are missing; go on with: rx90 monte-carlo"):
        page_of(folder)
    (folder / "study.json").write_text(json.dumps({**record, "study": "comparison"}))
    with pytest.raises(ForeignResult, match="one scenario of a comparison; name the folder it is in"):
        page_of(folder)
    del record["scenario"]["table"]["tolerance"]["gain"]
    record["scenario"]["table"]["tolerance"]["gian"] = [0.5]
    (folder / "study.json").write_text(json.dumps(record))
    with pytest.raises(ForeignResult, match="is damaged, or of another version of rx90"):
        page_of(folder)


def test_a_comparison_is_read_back_as_it_was_written(tmp_path):
    folder = page_folders.comparison(tmp_path / "compared")
    report = page_of(folder)
    assert report.parts[0].text == f"On {page_folders.NAME} {page_folders.NAME} scores 61.0 %, theirs 61.0 %."
    rms, held = (part for part in report.parts if isinstance(part, Plot))
    assert [series.label for series in rms.series] == [page_folders.NAME, "theirs"]
    assert rms.series[1].y == (3.4, 6.8, 10.2)
    assert held.series[0].low == (55.0, 55.0, 55.0)
    (folder / "report.json").write_text('{"about": {}, "scenarios": [{"name": "here"}]}')
    with pytest.raises(ForeignResult, match="is damaged, or of another version of rx90"):
        page_of(folder)


def test_a_page_of_ours_is_replaced_and_no_other_file(tmp_path, capsys):
    folder = page_folders.comparison(tmp_path / "compared")
    assert main(["report", str(folder)]) == 0
    assert "report.html: " in capsys.readouterr().out
    assert main(["report", str(folder)]) == 0
    (folder / "report.html").write_text("mine")
    assert main(["report", str(folder)]) == 2
    assert "changed since rx90 report wrote it" in capsys.readouterr().err
    assert (folder / "report.html").read_text() == "mine"
    assert main(["report", str(folder), "--force"]) == 0
    assert Elements((folder / "report.html").read_text()).count("table") == 3


def test_where_nothing_can_be_drawn_the_page_has_no_picture(copied, monkeypatch, tmp_path):
    report = Report("Title", (Paragraph("verdict"), Paragraph("rest")), {})
    assert with_picture(report, tmp_path) is report
    monkeypatch.setenv("MUJOCO_GL", "no-such-thing")
    assert with_picture(report, copied) is report
