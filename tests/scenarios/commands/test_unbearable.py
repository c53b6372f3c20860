"""A payload beyond the drives is refused by what would be taken to the cell, as by what simulates it."""

import pytest

from scenarios.cli import main
from scenarios.command_line.process import Status

BODY = "payload = { mass = 61.0, com = [0.31, 0.02, 0.12], inertia = { ixx = 0.51, iyy = 0.52, izz = 0.53 } }"


@pytest.mark.parametrize("words", [["record", "--out", "cell"], ["predict"]])
def test_a_payload_that_no_drive_bears_is_refused_and_nothing_is_written(tmp_path, capsys, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "heavy.toml").write_text(f'extends = "nominal"\n[plant]\n{BODY}\n[belief]\n{BODY}\n')
    assert main([words[0], "heavy.toml", *words[1:]]) == Status.BAD_INPUT
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("rx90: loaded: drive of joint6 would need up to ")
    assert error.endswith("use a lighter payload or a slower motion")
    assert [path.name for path in tmp_path.iterdir()] == ["heavy.toml"]
