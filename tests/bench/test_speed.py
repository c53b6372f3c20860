import json

import pytest

from bench import speed
from scenarios.rendering.content import Table


def test_a_figure_is_slower_if_it_is_in_every_round_and_one_tree_may_lack_it():
    rounds = [
        ({"a: x [s]": 3.0, "a: y [s]": 4.2, "b: z [MB]": 70.0}, {"a: x [s]": 2.0, "a: y [s]": 2.1}),
        ({"a: x [s]": 2.6, "a: y [s]": 2.0, "b: z [MB]": 90.0}, {"a: x [s]": 2.0, "a: y [s]": 2.1}),
    ]
    report = speed.page("de5ef1d", rounds)
    said, shown = report.parts
    assert said.text == "Slower than at de5ef1d by more than 10 % in every round: a: x [s]."
    assert isinstance(shown, Table)
    assert [[cell.text for cell in row] for row in shown.rows] == [
        ["a", "x [s]", "2.8", "2", "1.40 (1.30 to 1.50)"],
        ["a", "y [s]", "3.1", "2.1", "1.48 (0.95 to 2.00)"],
        ["b", "z [MB]", "80", "-", "-"],
    ]
    assert speed.page("de5ef1d", rounds[1:][:1] * 2).parts[0].mood.value == "bad"


def test_a_tree_that_cannot_run_a_phase_has_no_figure_of_it(tmp_path, monkeypatch):
    monkeypatch.setattr(speed, "PHASES", {"read": None})
    monkeypatch.setattr(speed, "COMMANDS", {"nothing": "-c pass", "broken": "-c 1/0 2>&-", "bad": "-c 'exit(2)'"})
    (tmp_path / "numpy.py").write_text("import absent")
    found = speed.measured(tmp_path, tmp_path)
    assert set(found) == {f"command: {name} [{unit}]" for name in ("nothing", "broken") for unit in ("s of CPU", "MB")}


@pytest.mark.slow
def test_every_phase_gives_figures_of_this_tree(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(speed, "SAMPLES", 3000)
    for name in speed.PHASES:
        speed.main(["--phase", name])
        assert all(value > 0.0 for value in json.loads(capsys.readouterr().out).values())
