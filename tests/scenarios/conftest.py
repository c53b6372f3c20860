"""Shared by tests of the command line: files that are right, a quick scenario, and one line on stderr."""

from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from here import HERE
from model_files import mjcf
from quick import BRIEF, RANDOM, quick_scenario
from undiagnosed import undiagnosed

from ident.recordings.files import write_recording
from ident.recordings.recording import Recording
from scenarios.cli import main


@pytest.fixture(scope="session")
def good(tmp_path_factory) -> Path:
    """A folder with a model, two recordings and a payload that can be read."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "arm.xml").write_text(mjcf())
    t = 0.004 * np.arange(500)
    for name, phase in (("a", 0.3), ("b", 0.7)):
        q = 0.8 * np.sin(2.0 * t[:, None] + np.arange(6) + phase)
        write_recording(Recording(t, q, 3.0 * np.cos(q) + 0.1 * q, name), folder / f"{name}.csv")
    (folder / "payload.toml").write_text("mass = 2.805\nknown = 'mass'\n")
    return folder


@pytest.fixture
def identify(good, capsys) -> Callable[..., str]:
    """Runs `rx90 identify` with some files replaced; gives its one line."""

    def run(**files: Path) -> str:
        paths = {
            "model": good / "arm.xml",
            "unloaded": good / "a.csv",
            "loaded": good / "b.csv",
            "payload": good / "payload.toml",
        } | files
        status = main(["identify", *(word for kind, path in paths.items() for word in (f"--{kind}", str(path)))])
        out, err = capsys.readouterr()
        assert status == 2
        assert out == ""
        assert err.count("\n") == 1
        assert "Traceback" not in err
        return err

    return run


@pytest.fixture
def _undiagnosed() -> Iterator[None]:
    with undiagnosed():
        yield


@pytest.fixture(scope="module")
def _all_undiagnosed() -> Iterator[None]:
    with undiagnosed():
        yield


@pytest.fixture(scope="session")
def scenario(tmp_path_factory) -> Path:
    """A quick one whose gains are drawn; a third of its trials are too heavy for the drives."""
    return quick_scenario(tmp_path_factory.mktemp("quick"), RANDOM, lasts=BRIEF)


@pytest.fixture
def _at_home(monkeypatch) -> None:
    """Trials of a command in this process: `test_interruptions` has workers, which import for seconds."""
    monkeypatch.setattr("scenarios.commands.studies.open_workers", lambda _: nullcontext(HERE))
