"""How far a study is, in words: the clock is set by hand."""

import io
import re
import time
from argparse import Namespace

import pytest
from rich.console import Console

from scenarios.command_line.output import console
from scenarios.support import progress, stages
from scenarios.support.progress import FIRST_LINE, LINE_EVERY, reporter, search_progress
from scenarios.support.stages import Stage, counted, stages_of


class Clock:
    """Seconds since some moment, as told."""

    now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def piped() -> Console:
    return Console(file=io.StringIO(), width=200)


def told(console: Console) -> list[str]:
    return console.file.getvalue().splitlines()


def test_a_line_tells_what_is_done_how_fast_and_how_long_it_will_take(clock):
    console = piped()
    with reporter("a study", 1000, 100, console, 3) as report:
        clock.now += 20.0
        report.advance(30, 2)
        clock.now += 5.0
        report.advance(30, 5)  # too soon for another line
        clock.now += LINE_EVERY
        report.tick()
    # 30 trials took a worker 20 s; of 870, the two others have spent as much on 60: 810 x 2 / 3 s by three workers.
    # Then 60 took 45 s, 0.75 s each; 840 are left, of which workers have spent 15 s, 10 s and 22.5 s, a batch's time.
    assert told(console) == [
        "a study: 130 of 1000 trials, 4.5 per second, 3 min 0 s left, 2 failed",
        "a study: 160 of 1000 trials, 4.0 per second, 3 min 14 s left, 7 failed",
    ]


def test_the_time_left_falls_with_the_clock_until_a_batch_takes_longer_than_those_before(clock):
    console, left = piped(), list[int]()
    with reporter("a study", 400, 0, console, 2) as report:
        clock.now += 100.0
        report.advance(50, 0)
        report.advance(50, 0)
        for _ in range(12):
            clock.now += LINE_EVERY
            report.tick()
    for line in told(console)[1:]:
        minutes, seconds = re.search(r"second, (?:(\d+) min )?(\d+) s left", line).groups()
        left.append(60 * int(minutes or 0) + int(seconds))
    # 300 trials of 2 s by two workers are 300 s; those under way do not count for more than theirs, 100 s.
    assert left == [*range(290, 199, -10), 200, 200]


def test_nothing_is_told_before_it_is_time(clock):
    console = piped()
    with reporter("a study", 7, 3, console, 2) as report:
        for wait in (FIRST_LINE, LINE_EVERY):
            before = len(told(console))
            clock.now += wait - 0.01
            report.tick()
            assert len(told(console)) == before
            clock.now += 0.01
            report.tick()
            assert len(told(console)) == before + 1
    assert told(console) == 2 * ["a study: 3 of 7 trials, 0 failed"]


@pytest.mark.parametrize(
    ("left", "words"),
    [(59, "59 s left"), (61, "1 min 1 s left"), (3599, "59 min 59 s left"), (7380, "2 h 3 min left")],
)
def test_the_time_that_is_left_is_told_in_units_one_can_grasp(clock, left, words):
    console = piped()
    with reporter("a study", left + 12, 0, console, 1) as report:
        clock.now += 12.0
        report.advance(12, 0)
    assert words in told(console)[0]


@pytest.mark.parametrize(
    ("seconds", "words"), [(4.0, "1.0 per second"), (4.1, "58.5 per minute"), (240.0, "1.0 per minute")]
)
def test_slow_trials_are_counted_by_the_minute(clock, seconds, words):
    console = piped()
    with reporter("a study", 12, 0, console, 1) as report:
        clock.now += seconds
        report.advance(4, 0)
    assert f", {words}, " in told(console)[0]


def test_a_terminal_shows_a_bar_with_trials_rate_and_failures(clock):
    console = Console(file=io.StringIO(), force_terminal=True, width=120, color_system=None)
    with reporter("a study", 8, 3, console, 1) as report:
        clock.now += 2.0
        report.advance(5, 4)
        report.tick()
    last = [line for line in told(console) if "a study" in line][-1]
    assert "a study ━" in last
    for words in ("8/8", "2.5 per second", "4 failed"):
        assert words in last


def test_a_narrow_terminal_shows_trials_time_left_and_failures_uncut(clock):
    console = Console(file=io.StringIO(), force_terminal=True, width=40, color_system=None)
    with reporter("a study of some length", 4000, 0, console, 1) as report:
        clock.now += 700.0
        report.advance(1000, 12)
    shown = [line for line in told(console) if "left" in line]
    assert shown[-1].split("2K")[-1].split() == ["1000/4000", "35", "min", "0", "s", "left", "12", "failed"]


@pytest.mark.parametrize(
    ("total", "done", "words"),
    [
        (None, 7.0, "simulating: for 1 min 15 s"),
        (80.0, 0.0, "simulating: for 1 min 15 s"),
        (80.0, 60.0, "simulating: 75 %, 25 s left"),
        (80.0, 81.0, "simulating: 100 %, 0 s left"),
    ],
)
def test_a_stage_tells_the_time_that_is_left_where_it_can_be_known(total, done, words):
    stage = Stage("simulating", total, began=200.0, done=done)
    assert stage.line(275.0) == words


def test_a_pipe_gets_a_line_now_and_then_while_work_says_nothing(monkeypatch):
    monkeypatch.setattr(stages, "FIRST_LINE", 0.02)
    monkeypatch.setattr(stages, "LINE_EVERY", 0.01)
    console = piped()
    with stages_of("reading", console) as under_way:
        under_way.begin("weighing", 3)
        under_way.advance(1.5)
        deadline = time.monotonic() + 30.0
        while len(told(console)) < 3 and time.monotonic() < deadline:
            time.sleep(0.01)
    lines = told(console)
    assert len(lines) >= 3
    assert all(re.fullmatch(r"weighing: 50 %, \d s left", line) for line in lines)
    time.sleep(0.05)
    assert told(console) == lines


def test_work_that_is_over_soon_says_nothing_in_a_pipe():
    console = piped()
    with stages_of("reading", console):
        pass
    assert told(console) == []


def test_a_terminal_shows_the_stage_and_nothing_when_it_is_over():
    console = Console(file=io.StringIO(), force_terminal=True, width=40, color_system=None)
    with stages_of("reading", console) as under_way:
        under_way.begin("weighing", 3)
        assert list(counted("abc", under_way)) == ["a", "b", "c"]
    text = console.file.getvalue()
    assert re.search(r"weighing ━{15} 0:00:0\d 00:00\n", text)
    assert text.endswith("\x1b[2K")  # its line is cleared


@pytest.mark.parametrize(("term", "moves"), [("xterm", True), ("dumb", False)])
def test_bars_are_for_terminals_whose_cursor_moves(term, moves, monkeypatch):
    monkeypatch.setenv("TERM", term)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert console(Namespace(quiet=False)).is_terminal is moves


def test_colours_that_are_forced_make_no_terminal_of_a_pipe(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert not console(Namespace(quiet=False)).is_terminal


def test_quiet_work_says_nothing(capsys):
    with stages_of("reading", console(Namespace(quiet=True))) as under_way:
        under_way.begin("weighing", 3)
    with reporter("a study", 7, 3, console(Namespace(quiet=True)), 2) as report:
        report.advance(4, 0)
    console(Namespace(quiet=True)).print("a word")
    assert capsys.readouterr().err == ""


def test_a_search_tells_how_long_it_will_take_from_what_it_has_tried_itself(clock, monkeypatch):
    monkeypatch.setattr("scenarios.support.progress.time", clock)
    output = piped()
    with search_progress("motions", 1000, output, 400) as say:
        clock.now += FIRST_LINE - 0.01
        say(500, lambda: "good")
        clock.now += 0.01
        say(600, lambda: "better")
        clock.now += LINE_EVERY
        say(850, lambda: "best")
    # 200 in 2 s are 100 per second, 400 are left; then 450 in 12 s, and 150 left.
    assert told(output) == ["motions: 600 of 1000, 4 s left, better", "motions: 850 of 1000, 4 s left, best"]


def test_the_bar_of_a_finished_study_tells_how_long_it_took(clock):
    console = Console(file=io.StringIO(), force_terminal=True, width=120, color_system=None)
    with reporter("a study", 8, 3, console, 1) as report:
        clock.now += 83.0
        report.advance(5, 0)
    assert "in 1 min 23 s" in [line for line in told(console) if "a study" in line][-1]
