"""Pages of measurements begin with what came out, and it is what their tables say."""

import runpy

import pytest
from places import ROOT

OPENING = runpy.run_path(str(ROOT / "docs" / "opening.py"))


@pytest.mark.parametrize("name", OPENING["RESULTS"])
def test_a_page_of_measurements_begins_with_what_its_tables_say(name):
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    assert text == OPENING["opened"](name, text)
    assert text.splitlines()[2].startswith("**")


PAGE = """# What a designed payload identifies

Written by a script.

| Scenario | Joints shown |
|---|---|
| `a` | 2 before, 6 after, of 6 |
| `b` | 7 before, 7 after, of 7 |
| `c` | 3 before, 4 after, of 5 |
"""


def test_a_result_is_read_from_the_table_and_replaces_the_one_before():
    once = OPENING["opened"]("payloads.md", PAGE)
    said = "**A designed payload identifies every joint in 2 of 3 scenarios, their own payloads in 1.**"
    assert once == PAGE.replace("\n\nWritten", f"\n\n{said}\n\nWritten", 1)
    other = OPENING["opened"]("payloads.md", once.replace("4 after", "5 after"))
    assert other.splitlines()[2] == said.replace("2 of 3", "3 of 3")
