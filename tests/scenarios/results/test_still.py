"""A still of the arm on a page: only what was drawn to its end."""

import io
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image

from scenarios.rendering.content import Paragraph, Report
from scenarios.results.pages import still, why_another, with_picture
from scenarios.support.errors import WrongValue
from sim.errors import PlantError


def _png() -> bytes:
    drawn = io.BytesIO()
    Image.new("RGB", (7, 5)).save(drawn, format="PNG")
    return drawn.getvalue()


PNG = _png()


@pytest.mark.parametrize(
    ("status", "written", "late"), [(0, True, False), (0, False, False), (1, True, False), (0, True, True)]
)
def test_a_picture_is_shown_where_it_was_drawn_to_its_end(status, written, late, monkeypatch):
    def drawn(command: list[str], *, timeout: float, **more: object) -> SimpleNamespace:
        if late:
            raise subprocess.TimeoutExpired(command, timeout)
        if written:
            Path(command[command.index("--render") + 1]).write_bytes(PNG)
        return SimpleNamespace(returncode=status)

    monkeypatch.setattr(subprocess, "run", drawn)
    found = still("nominal")
    assert (found is not None) == (status == 0 and written and not late)
    if found is not None:
        assert (found.png, found.width, found.height) == (PNG, 7, 5)


def test_a_record_that_is_none_gives_no_picture(tmp_path):
    report = Report("Title", (Paragraph("verdict"),), {})
    (tmp_path / "record.json").write_text("{")
    assert with_picture(report, tmp_path) is report


@pytest.mark.parametrize("error", [PlantError, WrongValue])
def test_a_scenario_or_robot_that_cannot_be_read_any_more_is_no_picture_but_a_reason(error, monkeypatch):
    def gone(named: str) -> None:
        raise error("moved away")

    monkeypatch.setattr("scenarios.results.pages.load_scenario", gone)
    assert why_another("mine", "0123456789abcdef") == "scenario mine can no longer be read: moved away"
