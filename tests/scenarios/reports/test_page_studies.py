"""Pages of studies, comparisons, answers and the paper: what their folders hold, read back."""

import json
import math

import page_folders
import pytest
from page_parts import Elements

from scenarios.benchmark.methods.answer import AnswerGain
from scenarios.benchmark.methods.answers import AnswerRow, AnswersFile, write_model
from scenarios.cli import main
from scenarios.rendering.content import Heading, Line, Mood, Table
from scenarios.rendering.plot import TONES, Plot
from scenarios.reports.pages import kind_of, page_of
from scenarios.results.monte_carlo import NORMAL
from scenarios.support.errors import ScenarioError


def test_studies_that_are_not_finished_or_not_whole_are_refused(tmp_path):
    folder = page_folders.study(tmp_path)
    assert kind_of(folder) == "monte-carlo"
    report = page_of(folder)
    assert report.parts[0].strong  # the verdict
    told = [[cell.text for cell in row] for part in report.parts if isinstance(part, Table) for row in part.rows]
    assert [row for row in told if row[0] in ("Trials", "First seed")] == [["Trials", "6"], ["First seed", "11"]]
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
    with pytest.raises(ScenarioError, match=r"3 of 9 trials are missing; continue with: rx90 monte-carlo"):
        page_of(folder)
    (folder / "study.json").write_text(json.dumps({**record, "study": "comparison"}))
    with pytest.raises(ScenarioError, match="one scenario of a comparison; give the folder that contains it"):
        page_of(folder)
    del record["scenario"]["table"]["tolerance"]["gain"]
    record["scenario"]["table"]["tolerance"]["gian"] = [0.5]
    (folder / "study.json").write_text(json.dumps(record))
    with pytest.raises(ScenarioError, match="damaged, or written by another version of rx90"):
        page_of(folder)


def test_a_comparison_is_read_back_as_it_was_written(tmp_path):
    folder = page_folders.comparison(tmp_path / "compared")
    report = page_of(folder)
    assert report.parts[0].text == f"On {page_folders.NAME} {page_folders.NAME} and theirs score 61.0 %."
    rms, held = (part for part in report.parts if isinstance(part, Plot))
    assert [series.label for series in rms.series] == [page_folders.NAME, "theirs"]
    assert rms.series[1].y == (3.4, 6.8, 10.2)
    assert held.series[0].low == (55.0, 55.0, 55.0)
    (folder / "report.json").write_text('{"about": {}, "scenarios": [{"name": "here"}]}')
    with pytest.raises(ScenarioError, match="damaged, or written by another version of rx90"):
        page_of(folder)


def test_a_page_of_ours_is_replaced_and_no_other_file(tmp_path, capsys):
    folder = page_folders.comparison(tmp_path / "compared")
    assert main(["report", str(folder)]) == 0
    size = (folder / "report.html").stat().st_size / 1e6
    assert f"report.html: {size:.2f} MB" in capsys.readouterr().out
    assert main(["report", str(folder)]) == 0
    (folder / "report.html").write_text("mine")
    assert main(["report", str(folder)]) == 2
    assert "changed since rx90 report wrote it" in capsys.readouterr().err
    assert (folder / "report.html").read_text() == "mine"
    other, told = tmp_path / "other.html", folder / "report.json"
    other.write_text("mine")
    told.write_text(told.read_text().replace("2011-09-25", r"2011\udcff"))  # of a name that is no text
    assert main(["report", str(folder), "--out", str(other), "--force"]) == 0
    assert Elements(other.read_text()).count("table") == 3
    assert r"2011\udcff" in other.read_text()
    assert (folder / "report.html").read_text() == "mine"


def test_answers_without_a_truth_have_a_page_of_their_own(tmp_path):
    gains = [
        AnswerGain(joint=1, estimate=0.9, std=0.02, identifiable=True),
        AnswerGain(joint=2, estimate=None, std=None, identifiable=False, reason="too light"),
        AnswerGain(joint=3, estimate=-1.5, std=None, identifiable=True),
    ]
    given = {"problem": "monday", "digest": "ab12", "seconds": 1.5}
    rows = [
        AnswerRow(method="ls-2011", files={"own.py": "cd34"}, gains=gains, **given),
        AnswerRow(method="slow", files={}, failure="MethodTimedOut", reason="took longer than 60 s", **given),
    ]
    write_model(AnswersFile(answers=rows), tmp_path / "answers.json")
    report = page_of(tmp_path)
    assert report.parts[0].text == (
        "2 answers of 2 methods to 1 problem: 2 gains, 1 refused, 1 call without any answer."
    )
    assert (report.parts[0].strong, report.parts[0].mood) == (True, Mood.BAD)
    assert "The true gains of these problems are unknown" in report.parts[1].text
    (plot,) = [part for part in report.parts if isinstance(part, Plot)]
    (drawn,) = plot.series  # the method that did not answer has none
    assert (drawn.label, drawn.x, drawn.y, drawn.low, drawn.high) == (
        "ls-2011", ("1", "3"), (0.0, 0.0), (-4.4444, 0.0), (4.4444, 0.0)
    )  # fmt: skip
    assert plot.x.categories == ("1", "2", "3")
    assert plot.y.unit == "%"
    tables = [part for part in report.parts if isinstance(part, Table)]
    said = [[[cell.text for cell in row] for row in table.rows] for table in tables]
    assert [column.title for column in tables[0].columns] == ["Joint", "ls-2011", "slow"]
    assert tables[0].columns[1].unit == "N (m)/unit"  # nobody says here which joints slide
    late = "MethodTimedOut"
    assert said[0] == [["1", "0.90 ± 0.04", late], ["2", "refused", late], ["3", "-1.5", late]]
    assert said[1] == [["slow", "all", "took longer than 60 s"], ["ls-2011", "2", "too light"]]
    assert said[2:] == [[["monday", "ab12"]], [["ls-2011: own.py", "cd34"]]]
    assert len(report.document["answers"]) == 2
    (tmp_path / "answers.json").write_text('{"answers": [{}]}')
    with pytest.raises(ScenarioError, match="not a file of answers"):
        page_of(tmp_path)
    (tmp_path / "answers.json").write_text('{"answers": []}')
    with pytest.raises(ScenarioError, match="contains no answer"):
        page_of(tmp_path)


def answered(problem: str, method: str, *estimates: float | None) -> AnswerRow:
    gains = [
        AnswerGain(joint=j, estimate=g, std=None, identifiable=g is not None, reason=f"of {method}")
        for j, g in enumerate(estimates, 1)
    ]
    return AnswerRow(problem=problem, digest=f"of {problem}", method=method, files={}, seconds=0.5, gains=gains)


def test_every_problem_has_answers_of_its_own_and_methods_beyond_the_tones_stand_in_its_table(tmp_path):
    rows = [answered("monday", f"m{k}", 0.5 + 0.1 * k, 2.0) for k in range(len(TONES) + 2)]
    rows += [
        answered("monday", "mute", None, None),
        answered("tuesday", "m0", 3.0),
        answered("tuesday", "m1", 4.0, 5.0),
    ]
    write_model(AnswersFile(answers=rows), tmp_path / "answers.json")
    report = page_of(tmp_path)
    assert (report.parts[0].text, report.parts[0].mood) == (
        "9 answers of 7 methods to 2 problems: 15 gains, 2 refused, 0 calls without any answer.",
        Mood.PLAIN,
    )
    headings = [part.text for part in report.parts if isinstance(part, Heading)]
    assert headings == ["monday", "tuesday", "Problems"]
    monday, tuesday = (part for part in report.parts if isinstance(part, Plot))
    assert [series.label for series in monday.series] == ["m0", "m1", "m2", "m3"]
    assert monday.caption.endswith("method estimates none. 2 more in the table only.")
    assert tuesday.caption.endswith("method estimates none.")
    # About 3.5 in the middle of 3 and 4.
    assert [(series.x, series.y) for series in tuesday.series] == [
        (("1",), (-14.286,)), (("1", "2"), (14.286, 0.0))
    ]  # fmt: skip
    assert tuesday.x.categories == ("1", "2")  # of the method that has most
    tables = [part for part in report.parts if isinstance(part, Table)]
    assert [len(table.rows) for table in tables] == [2, 2, 2, 2]  # joints and reasons; joints; what was asked
    assert [len(table.columns) for table in tables] == [8, 3, 3, 2]  # a column a method
    assert [cell.text for cell in tables[2].rows[1]] == ["2", "-", "5"]  # m0 says nothing of joint 2
    assert all(len(row) == len(table.columns) for table in tables for row in table.rows)
    assert [[cell.text for cell in row] for row in tables[1].rows] == [
        ["mute", "1", "of mute"], ["mute", "2", "of mute"]
    ]  # fmt: skip
    assert [[cell.text for cell in row] for row in tables[3].rows] == [
        ["monday", "of monday"], ["tuesday", "of tuesday"]
    ]  # fmt: skip
