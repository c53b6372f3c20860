import json
import math

import page_folders
import pytest
from page_parts import drawn_intervals

from scenarios.rendering.content import Line, Table
from scenarios.rendering.plot import Plot
from scenarios.results.pages import kind_of, page_of
from scenarios.results.studies import NORMAL
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
    held = next(part for part in report.parts if isinstance(part, Plot)).figure().axes[0].lines[-1].get_ydata()[0]
    assert held == pytest.approx(100 * math.erf(math.sqrt(2.0)), rel=1e-12) == 100 * NORMAL
    record = json.loads((folder / "study.json").read_text())
    (folder / "study.json").write_text(json.dumps({**record, "seed": 13}))
    with pytest.raises(ScenarioError, match=r"study\.json: changed or damaged since it was written"):
        page_of(folder)
    del record["digest"]
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
    rms = "(rms error 2.6 %), theirs scores 0.0 % (rms error 7.3 %)."  # of 1.2, 2.4 and 3.6 %, of 3.4, 6.8 and 10.2 %
    assert report.parts[0].text == f"On {page_folders.NAME} {page_folders.NAME} scores 66.7 % {rms}"
    rms, held = (part.figure().axes[0] for part in report.parts if isinstance(part, Plot))
    assert [bars.get_label() for bars in rms.containers] == [page_folders.NAME, "theirs"]
    assert [bar.get_height() for bars in rms.containers for bar in bars] == pytest.approx(
        [1.2, 2.4, 3.6, 3.4, 6.8, 10.2]
    )
    # Of one trial, by Clopper and Pearson.
    assert [low for _, low, _ in drawn_intervals(held)[0].values()] == pytest.approx([2.5] * 3, rel=1e-9)
    (folder / "report.json").write_text('{"about": {}, "scenarios": [{"name": "here"}]}')
    with pytest.raises(ScenarioError, match="damaged, or written by another version of rx90"):
        page_of(folder)
