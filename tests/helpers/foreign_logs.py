"""A log of three joints, its columns in an order of their own, and what has to be said of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from refusals import refused

from ident.recordings.description import Channels, LogDescription
from ident.recordings.files import read_recording
from ident.recordings.recording import Recording
from ident.support.errors import RecordingError

T = 3.7 + 0.004 * np.arange(90)
Q = np.column_stack((np.sin(3.0 * T), -0.7 * np.cos(2.0 * T), 0.3 * np.sin(5.0 * T + 0.4)))
V = np.column_stack((1.3 * np.cos(5.0 * T), np.sin(4.0 * T) + 0.2, -2.1 * np.cos(3.0 * T)))
ROUNDED = {"rtol": 1e-14, "atol": 1e-14}  # a product and a sum of float64 each way
DESCRIPTION = LogDescription(
    signal="current",
    t=Channels(columns=("time",), unit=("s",)),
    q=Channels(columns=("a", "b", "c"), unit=("rad",)),
    v=Channels(columns=("x", "y", "z"), unit=("A",)),
)


def table(t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> dict[str, np.ndarray]:
    """Columns of a foreign log, in an order of their own."""
    return {"x": v[:, 0], "mode": 7.0 + 0.0 * T, "b": q[:, 1], "y": v[:, 1], "time": t, "c": q[:, 2], "a": q[:, 0]} | {
        "z": v[:, 2]
    }


def csv(path: Path, columns: dict[str, np.ndarray], separator: str = ",", header: bool = True) -> Path:
    rows = np.column_stack(list(columns.values()))
    head = separator.join(columns) if header else ""
    np.savetxt(path, rows, fmt="%.17g", delimiter=separator, header=head, comments="")
    if not header:
        path.write_text(path.read_text().lstrip("\n"))
    return path


def channels(kind: str, **changes: tuple) -> LogDescription:
    return replace(DESCRIPTION, **{kind: replace(getattr(DESCRIPTION, kind), **changes)})


def assert_same(found: Recording, t: np.ndarray = T, q: np.ndarray = Q, v: np.ndarray = V) -> None:
    for one, other in ((found.t, t), (found.q, q), (found.v, v)):
        np.testing.assert_allclose(one, other, **ROUNDED)


def unread(message: str, path: Path, description: LogDescription | None = None) -> str:
    """The line with which the reading of a log is refused."""
    return str(refused(RecordingError, message, read_recording, path, description))
