"""How far a study is, in words: the clock is set by hand."""

import io

import pytest
from rich.console import Console

from scenarios.workers import progress
from scenarios.workers.progress import FIRST_LINE, LINE_EVERY, reporter


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
    with reporter("a study", 1000, 100, console) as report:
        clock.now += 20.0
        report.advance(30, 2)
        report.advance(50, 5)  # too soon for another line
        clock.now += LINE_EVERY
        report.tick()
    # 30 in 20 s are 1.5 a second, 870 are left; then 80 in 30 s are 2.7 a second, 820 are left: 307.5 s.
    assert told(console) == [
        "a study: 130 of 1000 trials, 1.5 a second, 9 min 40 s left, 2 failed",
        "a study: 180 of 1000 trials, 2.7 a second, 5 min 8 s left, 7 failed",
    ]


def test_nothing_is_told_before_it_is_time(clock):
    console = piped()
    with reporter("a study", 7, 3, console) as report:
        for wait in (FIRST_LINE, LINE_EVERY):
            before = len(told(console))
            clock.now += wait - 0.01
            report.tick()
            assert len(told(console)) == before
            clock.now += 0.01
            report.tick()
            assert len(told(console)) == before + 1
    assert told(console) == 2 * ["a study: 3 of 7 trials, 0.0 a second, 0 failed"]


@pytest.mark.parametrize(
    ("left", "words"),
    [(59, "59 s left"), (61, "1 min 1 s left"), (3599, "59 min 59 s left"), (7380, "2 h 3 min left")],
)
def test_the_time_that_is_left_is_told_in_units_one_can_grasp(clock, left, words):
    console = piped()
    with reporter("a study", left + 12, 0, console) as report:
        clock.now += 12.0
        report.advance(12, 0)
    assert words in told(console)[0]


def test_a_terminal_shows_a_bar_with_trials_rate_and_failures(clock):
    console = Console(file=io.StringIO(), force_terminal=True, width=120, color_system=None)
    with reporter("a study", 8, 3, console) as report:
        clock.now += 2.0
        report.advance(5, 4)
        report.tick()
    last = [line for line in told(console) if "a study" in line][-1]
    assert "a study ━" in last
    for words in ("8/8", "2.5 a second", "4 failed"):
        assert words in last


def test_the_bar_of_a_finished_study_tells_how_long_it_took():
    clock = Clock()
    console = Console(file=io.StringIO(), force_terminal=True, width=120, color_system=None, get_time=lambda: clock.now)
    with reporter("a study", 8, 3, console) as report:
        clock.now += 83.0
        report.advance(5, 0)
    assert "0:01:23" in [line for line in told(console) if "a study" in line][-1]
