"""Progress as text; the clock is set by hand."""

import io
import re
import time
from argparse import Namespace

import pytest
from rich.console import Console

from scenarios.command_line.output import console
from scenarios.support import progress
from scenarios.support.progress import Progress, counted, progress_of


class Clock:
    now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def on_terminal(width: int) -> Console:
    return Console(file=io.StringIO(), force_terminal=True, width=width, color_system=None)


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


def test_counted_work_has_numbers_and_its_last_note(clock):
    state = Progress("a study", 1000, 100)
    clock.now += 3.0
    assert state.line(counted=True) == "a study: 100 of 1000, for 3 s"
    clock.now -= 3.0
    clock.now += 20.0
    state.advance(30, "2 failed")
    state.advance(20, "7 failed")
    assert state.line(counted=True) == "a study: 150 of 1000, 5 min 40 s left, 7 failed"


def test_a_slow_note_is_computed_once_a_second_and_at_the_end(clock):
    calls: list[int] = []
    state = Progress("a search", 9)
    for _ in range(4):
        state.advance(2, lambda: f"best {calls.append(1)}")
        clock.now += 0.4
    assert len(calls) == 2
    state.advance(1, lambda: f"best {calls.append(1)}")
    assert len(calls) == 3


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


def test_short_work_prints_nothing_to_a_pipe():
    piped = Console(file=io.StringIO(), width=200)
    with progress_of("reading", piped, 7, 3) as under_way:
        under_way.advance(4, "0 failed")
    assert lines(piped) == []


def test_a_terminal_shows_the_stage_and_clears_it_at_the_end():
    terminal = on_terminal(40)
    with progress_of("reading", terminal) as under_way:
        under_way.begin("weighing", 3)
        assert list(counted("abc", under_way)) == ["a", "b", "c"]
    text = terminal.file.getvalue()
    assert re.search(r"weighing ━{15} 0:00:0\d 00:00\n", text)
    assert text.endswith("\x1b[2K")


@pytest.mark.parametrize(("width", "label"), [(120, True), (40, False)])
def test_the_bar_of_counted_work_stays_and_fits_a_narrow_terminal(width, label):
    terminal = on_terminal(width)
    with progress_of("a study of some length", terminal, 4000, 1000) as under_way:
        under_way.advance(3000, "12 failed")
    last = next(line for line in reversed(lines(terminal)) if "4000/4000" in line).split("2K")[-1]
    assert ("a study of some length ━" in last) is label
    assert last.endswith("12 failed")


@pytest.mark.parametrize(("term", "moves"), [("xterm", True), ("dumb", False)])
def test_bars_are_for_terminals_whose_cursor_moves(term, moves, monkeypatch):
    monkeypatch.setenv("TERM", term)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert console(Namespace(quiet=False)).is_terminal is moves


def test_forced_colours_do_not_make_a_terminal_of_a_pipe(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert not console(Namespace(quiet=False)).is_terminal


def test_quiet_work_prints_nothing(capsys):
    with progress_of("a study", console(Namespace(quiet=True)), 7, 3) as under_way:
        under_way.advance(4, "0 failed")
    console(Namespace(quiet=True)).print("a word")
    assert capsys.readouterr().err == ""
