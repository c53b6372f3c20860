import io
import re
import time

import pytest
from rich.console import Console

from scenarios.support import progress
from scenarios.support.progress import Progress, progress_of


class Clock:
    now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def lines(console: Console) -> list[str]:
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize(
    ("total", "done", "words"),
    [
        (None, 7.0, "simulating: for 1 min 15 s"),
        (80.0, 5.0, "simulating: for 1 min 15 s"),  # nothing of this session is done yet
        (80.0, 65.0, "simulating: 81 %, 19 s left"),  # 60 of this session in 75 s, 15 remain
        (80.0, 81.0, "simulating: 100 %, 0 s left"),
        (7380.0, 80.0, "simulating: 1 %, 2 h 1 min left"),
    ],
)
def test_the_remaining_time_follows_from_the_pace_of_this_session(clock, total, done, words):
    state = Progress("simulating", total, 5.0)
    clock.now += 75.0
    state.reach(done)
    assert state.line(counted=False) == words


def test_a_pipe_gets_lines_at_intervals_even_if_nothing_is_reported(monkeypatch):
    monkeypatch.setattr(progress, "FIRST_LINE", 0.02)
    monkeypatch.setattr(progress, "LINE_EVERY", 0.01)
    piped = Console(file=io.StringIO(), width=200)
    with progress_of("reading", piped) as under_way:
        under_way.begin("weighing", 3)
        under_way.advance(1.5)
        deadline = time.monotonic() + 30.0
        while len(lines(piped)) < 3 and time.monotonic() < deadline:
            time.sleep(0.01)
    seen = lines(piped)
    assert len(seen) >= 3
    assert all(re.fullmatch(r"weighing: 50 %, \d s left", line) for line in seen)
    time.sleep(0.05)
    assert lines(piped) == seen
