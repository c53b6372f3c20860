import json
import re
from collections import Counter
from dataclasses import replace
from html import unescape

import pytest
from page_parts import cells

from scenarios.rendering import Page, renderer
from scenarios.rendering.content import Column, Heading, Line, Mood, Paragraph, Picture, Report, Table
from scenarios.rendering.html import script_json, sections
from scenarios.rendering.plot import Plot


def text_of(page: str) -> str:
    """All text of a page outside scripts and styles."""
    return unescape(re.sub(r"<(script|style)\b.*?</\1>|<[^>]*>", "", page, flags=re.DOTALL))


EVIL = "</script><script>alert(1)</script><!--\"'&<img src=x onerror=alert(2)>{{ 7 * 7 }}"


def draw(axes) -> None:
    axes.bar([EVIL, "two"], [1.5, 2.5], label=EVIL)


DRAWN = Plot(title=EVIL, caption=EVIL, x=EVIL, y=EVIL, draw=draw)


def evil_report() -> Report:
    table = Table(title=EVIL, columns=(Column(title=EVIL, unit=EVIL, words=True),), rows=(cells(EVIL),))
    parts = (Paragraph(EVIL, Mood.BAD, strong=True), Heading(EVIL), Line(EVIL), table, Picture(EVIL, b"\x89PNG"), DRAWN)
    return Report(EVIL, parts, {EVIL: EVIL})


def test_no_text_of_a_report_is_html_and_a_page_asks_for_nothing_from_anywhere():
    page = renderer("html")(evil_report(), Page())
    tags = re.findall(r"<(\w+)\b([^>]*)>", page)
    found = Counter(name for name, _ in tags)
    assert (found["script"], found["img"], found["svg"]) == (1, 1, 1)  # the script is the document, which is data
    assert found["link"] == found["iframe"] == 0
    assert all('src="data:image/png;base64,' in attributes for name, attributes in tags if name == "img")
    assert not any(re.search(r"\son\w+=", re.sub('"[^"]*"', "", attributes)) for _, attributes in tags)
    assert {"h1", "h2", "code", "figcaption", "th"} <= set(found)
    # Title twice, paragraph, heading, line, table (title, column, unit, cell), captions, plot (title, caption, label).
    assert text_of(page).count(EVIL) >= 13
    assert "49" not in text_of(page)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert unescape(policy[1]) == "default-src 'none'; style-src 'unsafe-inline'; img-src data:"  # no script
    assert not re.search(r"url\((?!#)", page)


def test_what_stands_between_backticks_is_code_and_as_it_was_elsewhere():
    said = "mount more, `rx90 payload <b>` designs it; one ` alone stays; 4 N m, 2 sigma"
    table = Table(columns=(Column(title="t", words=True),), rows=(cells("say `iv`"),))
    report = Report("Title", (Paragraph(said), table), {})
    page = renderer("html")(report, Page())
    assert (
        "more, <code>rx90 payload &lt;b&gt;</code> designs it; one ` alone stays; 4 N&nbsp;m, 2&nbsp;sigma</p>" in page
    )
    assert "say <code>iv</code></t" in page
    assert "off by 3.7&nbsp;%</p>" in renderer("html")(Report("Title", (Paragraph("off by 3.7 %"),), {}), Page())
    assert "`rx90 payload <b>`" in renderer("text")(report, Page())


def test_json_cannot_end_its_element_and_means_the_same():
    text = script_json({EVIL: [EVIL, 0.125, None]})
    assert not set("<>&") & set(text)
    assert json.loads(text) == {EVIL: [EVIL, 0.125, None]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        script_json(float("nan"))


def test_rows_beyond_those_of_a_screen_are_folded_away():
    table = Table(columns=(Column(title="n"),), rows=tuple(cells(str(k)) for k in range(7)), shown=3, rest="and 4 more")
    page = renderer("html")(Report("Title", (table,), {}), Page())
    head, folded = page.split('<details class="rest"><summary>and 4 more</summary>')
    assert [f">{k}<" in head for k in range(7)] == [True] * 3 + [False] * 4
    assert [f">{k}<" in folded for k in range(7)] == [False] * 3 + [True] * 4
    whole = renderer("html")(Report("T", (replace(table, shown=None),), {}), Page())
    assert "<details" not in whole


def test_a_verdict_stands_after_the_first_column_and_the_document_is_on_the_page():
    columns = (Column(title="Joint"), Column(title="Gain"), Column(title="Verdict", words=True))
    page = renderer("html")(
        Report("T", (Table(columns=columns, rows=(cells("2", "1.5", "passed"),)),), {"a": 0.5}), Page()
    )
    assert "".join(text_of(page).split()).endswith("JointVerdictGain2passed1.5")
    assert '{"a":0.5}' in page


def test_parts_stand_below_their_headings_and_adjacent_plots_together():
    parts = (DRAWN, DRAWN, Paragraph("text"), DRAWN, Heading("more"), Heading("last"), DRAWN)
    found = [(heading and heading.text, [len(group) for _, group in groups]) for heading, groups in sections(parts)]
    assert found == [(None, [2, 1, 1]), ("more", []), ("last", [1])]
