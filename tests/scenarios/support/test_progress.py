import io
import re

from rich.console import Console

from scenarios.support import progress
from scenarios.support.progress import progress_of


def shown(monkeypatch, *, terminal: bool) -> str:
    """What is written of work on 7 of 11 parts, after 2 that were done before."""
    notes = list[str]()
    monkeypatch.setattr(progress, "NOTE_EVERY", 600.0)
    console = Console(file=io.StringIO(), width=100, force_terminal=terminal, color_system=None)
    with progress_of("weighing", console, 11, 2) as under_way:
        for done in (3, 5):
            under_way.reach(done, lambda: notes.append("slow") or f"{len(notes)} notes")
        under_way.advance(2)
    assert len(notes) == terminal  # the first one, and no more for a while
    return console.file.getvalue()


def test_a_bar_counts_what_is_done_on_a_terminal_and_nothing_is_written_to_a_pipe(monkeypatch):
    assert shown(monkeypatch, terminal=False) == ""
    assert re.search(r"weighing .* 7/11 ", shown(monkeypatch, terminal=True))
