import re
import shlex
from dataclasses import replace

import pytest
from page_parts import cells

from scenarios.rendering import Page, renderer
from scenarios.rendering.content import (
    Cell,
    Column,
    Heading,
    Line,
    Mood,
    Paragraph,
    Picture,
    Report,
    Table,
    column,
    table,
)
from scenarios.rendering.wording import in_unit, percent, plus_minus, rounded, two_sigma
from scenarios.support.texts import continued

COLUMNS = (Column(title="Joint"), Column(title="Gain", unit="N m/unit"), Column(title="Verdict", words=True))
TABLE = Table(
    title="Gains",
    columns=COLUMNS,
    rows=(cells("1", "0.9401234", "passed"), cells("2", "-17.25", "refused")),
    shown=1,
    rest="and 1 more",
)
REPORT = Report(
    "What was found",
    (
        Heading("First"),
        TABLE,
        Paragraph("Words that go on for longer than a narrow page is wide.", Mood.GOOD, strong=True),
        Line("rx90 identify --model a/very/long/path/that/nobody/may/break.xml --payload p.toml"),
        Picture("What it shows", b""),
    ),
    {"answer": 0.125},
)


def test_a_column_has_its_unit_at_the_end_of_its_title_and_one_cell_an_item():
    gain = column("exec: my [own] method [N (m)/unit]", lambda item: None if item == 7 else f"{item / 8:g}")
    made = table([3, 7], column("Joint", lambda item: item), gain, column("Left [over", str, words=True), title="Gains")
    assert made.columns == (
        Column(title="Joint"),
        Column(title="exec: my [own] method", unit="N (m)/unit"),
        Column(title="Left [over", words=True),
    )
    assert made.rows == (cells("3", "0.375", "3"), cells("7", "-", "7"))


def test_a_table_is_set_wide_then_close_then_continued_below():
    columns = tuple(Column(title=str(k) * width) for k, width in enumerate((5, 8, 7, 9)))  # 29, with gaps 35 or 32
    report = Report("T", (Table(columns=columns, rows=(cells(*"abcd"),)),), {})
    whole, split = "00000  11111111  2222222  333333333", ["00000  11111111  2222222", "00000  333333333"]
    alone = ["00000  11111111", "00000  2222222", "00000  333333333"]
    close = [" ".join(whole.split())]
    for width, heads in ((35, [whole]), (34, close), (32, close), (31, split), (24, split), (23, alone), (3, alone)):
        text = renderer("text")(report, Page(width=width))
        assert [line for line in text.splitlines() if "0" in line] == heads


def test_a_table_keeps_the_values_of_its_numbers_under_headings_with_units():
    rows = ((1, 0.123456, 0.02), (2, None, 0.5))
    shown = table(
        rows,
        column("Joint", lambda row: row[0]),
        column("Gain\nfound [N m/unit]", lambda row: rounded(row[1], 0.03)),
        column("2 sigma [%]", lambda row: two_sigma(row[2])),
        column("2 sigma [%]", lambda row: Cell(percent(row[2]), Mood.BAD)),
        column("Seen", lambda row: f"{row[2]:.1f}"),
        column("Verdict", lambda _: "late", words=True),
    )
    assert shown.rows[0][1].text == "0.123"
    assert shown.values == {
        "Joint": [1, 2],
        "Gain found [N m/unit]": [0.123456, None],
        "2 sigma [%]": [4.0, 100.0],
        "2 sigma, 2 sigma [%]": [2.0, 50.0],
        "Seen": [0.0, 0.5],
        "Verdict": ["late", "late"],
    }


@pytest.mark.parametrize("width", [35, 34, 31, 30, 22, 21])
def test_no_word_is_broken_and_words_wrap_before_a_table_is_continued(width):
    columns = (Column(title="Joint"), Column(title="Name", words=True), Column(title="2 sigma"), COLUMNS[2])
    rows = tuple(cells(joint, f"joint{joint}", "0.79", "not identified") for joint in "12")
    lines = renderer("text")(Report("", (Table(columns=columns, rows=rows),), {}), Page(width=width)).splitlines()[2:]
    assert max(map(len, lines)) <= width
    assert len([line for line in lines if line.startswith("Joint")]) == {30: 2, 22: 2, 21: 3}.get(width, 1)
    words = "Joint Name 2 sigma Verdict 1 2 joint1 joint2 0.79 not identified"
    assert {word for line in lines for word in line.split()} == set(words.split())


@pytest.mark.parametrize("width", [200, 80, 40, 12])
def test_a_command_goes_on_as_a_shell_joins_it(width):
    words = ["rx90", "identify", "--model", "my arm.xml", "--loaded", "b1.csv", "b2.csv", "--payload", "it's.toml"]
    command = f"{shlex.join(words)} --method nls"
    lines = continued(command, width).splitlines()
    assert shlex.split("\n".join(lines).replace("\\\n", "")) == shlex.split(command)
    assert all(len(line) <= max(width, len("  'it'\"'\"'s.toml' \\")) for line in lines)
    assert (len(lines) == 1) == (width >= len(command))
    if width == 40:  # an option stands beside its value
        assert lines[:2] == ["rx90 identify --model 'my arm.xml' \\", "  --loaded b1.csv b2.csv \\"]
    assert continued("rx90 run x | cat > y", 5) == "rx90 run x | cat > y"


@pytest.mark.parametrize("width", [80, 40, 24, 18])
def test_text_fits_the_page_and_cuts_no_number(width):
    text = renderer("text")(REPORT, Page(width=width))
    path = "a/very/long/path/that/nobody/may/break.xml"
    assert path in text
    assert all(len(line) <= width for line in text.splitlines() if path not in line)
    assert "0.9401234" in text
    assert "and 1 more (--format markdown shows them)" in " ".join(text.split())
    assert "-17.25" not in text
    assert "…" not in text
    said = Paragraph("one gain is 3.7 % off"), Paragraph("one puts 1.23 N m")
    told = renderer("text")(Report("Title", said, {}), Page(width=16))
    assert "3.7 %" in told
    assert "1.23 N m" in told
    assert "\x1b" not in text


def test_moods_are_colours_where_there_are_any(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    coloured = renderer("text")(REPORT, Page(width=80, colour=True))
    assert "\x1b[1;32mWords" in coloured
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured).split() == renderer("text")(REPORT, Page(width=80)).split()


def test_markdown_has_every_row():
    text = renderer("markdown")(REPORT, Page())
    assert text.startswith("# What was found\n\n## First\n\n**Gains**\n\n| Joint | Gain [N m/unit] | Verdict |\n")
    assert "| ---: | ---: | --- |\n| 1 | 0.9401234 | passed |\n| 2 | -17.25 | refused |" in text
    assert "**Words that go on" in text
    table = Table(columns=(Column(title="95 %\nbelow", unit="%"),), rows=(cells("a|b|c"),))
    text = renderer("markdown")(Report("Title", (table,), {}), Page())
    assert "| 95 % below [%] |\n| ---: |\n| a\\|b\\|c |" in text


def test_json_is_the_document_and_no_number_that_is_none():
    assert renderer("json")(REPORT, Page()) == '{\n  "answer": 0.125\n}\n'
    with pytest.raises(ValueError, match="not JSON compliant"):
        renderer("json")(Report("", (), {"answer": float("nan")}), Page())


def test_what_is_for_files_is_on_a_screen_when_asked_for():
    heading = Heading("Every check", file_only=True)
    report = Report("T", (heading, replace(TABLE, file_only=True), Paragraph("end")), {})
    shown, whole = (renderer("text")(each, Page()) for each in (report, report.in_full))
    assert shown.split() == ["T", "end"]
    assert "0.9401234" in whole
    for form in ("markdown", "html"):
        assert all(word in renderer(form)(report, Page()) for word in ("Every check", "0.9401234"))
    column = replace(TABLE, columns=(COLUMNS[0], replace(COLUMNS[1], file_only=True), COLUMNS[2]))
    forms = ("text", "markdown", "html")
    found = {form: "0.9401234" in renderer(form)(Report("T", (column,), {}), Page()) for form in forms}
    assert found == {"text": False, "markdown": True, "html": True}


def test_numbers_have_the_decimals_that_two_digits_of_their_spread_need_and_short_lengths_are_in_millimetres():
    assert [rounded(11.78412, spread) for spread in (0.59, 0.059, 0.0099, 12.0)] == ["11.78", "11.784", "11.7841", "12"]
    assert [rounded(0.5, None), rounded(0.5, 0.0), rounded(None, 0.1)] == ["0.5000", "0.5000", "-"]
    assert in_unit("m", 0.25, None, -0.003) == ("mm", (250.0, None, -3.0))
    assert in_unit("m", 0.25, -1.0) == ("m", (0.25, -1.0))
    assert in_unit("kg", 0.25) == ("kg", (0.25,))
    for value, spread, text in (
        (7.0531, 0.0482, "7.05 ± 0.05"),
        (7.0531, 0.0142, "7.053 ± 0.014"),
        (-0.00034, 0.00061, "-0.0003 ± 0.0006"),
        (4.2, 0.0996, "4.20 ± 0.10"),
        (1234.0, 23.0, "1234 ± 23"),
        (7.025, 0.0, "7.025"),
    ):
        assert plus_minus(value, spread) == text
