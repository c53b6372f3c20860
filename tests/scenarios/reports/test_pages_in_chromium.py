"""Pages as a browser shows them: Debian's Chromium, driven by playwright, judged by axe."""

import importlib.util
import json
import re
import shutil
from pathlib import Path

import page_folders
import pytest

from scenarios.cli import main
from scenarios.rendering import Page, renderer
from scenarios.rendering.content import rounded
from scenarios.reports.pages import kind_of, page_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MISSING = [name for name in ("playwright", "axe_playwright_python") if importlib.util.find_spec(name) is None]
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or bool(MISSING), reason=f"needs {', '.join(MISSING) or 'a Chromium in the path'}"
)
KINDS = [
    "run",
    "comparison",
    "answers",
    *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("identification", "check", "monte-carlo", "sensitivity")),
]
DRAWN = "document.documentElement.dataset.drawn === 'all'"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The folder of a kind, made when it is first asked for: tests may be spread over processes."""
    root, made = tmp_path_factory.mktemp("pages"), dict[str, Path]()
    makers = {
        "run": lambda: page_folders.run(made_folder("run here")),
        "identification": lambda: page_folders.identification(root / "again", folder("run")),
        "check": lambda: page_folders.check(root / "check", folder("run")),
        "monte-carlo": lambda: page_folders.study(made_folder("study here")),
        "sensitivity": lambda: page_folders.budget(made_folder("budget here")),
        "comparison": lambda: page_folders.comparison(root / "comparison"),
        "answers": lambda: page_folders.answers(root / "answers"),
    }

    def made_folder(name: str) -> Path:
        (root / name).mkdir()
        return root / name

    def folder(kind: str) -> Path:
        if kind not in made:
            made[kind] = makers[kind]()
            assert kind_of(made[kind]) == kind
        return made[kind]

    return folder


@pytest.fixture(scope="module")
def chromium():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def seen(folders, chromium):
    """Pages opened once each, by kind: the page, what its console said, what it asked for."""
    opened: dict[str, tuple] = {}

    def open_page(kind: str) -> tuple:
        if kind not in opened:
            path = folders(kind) / "report.html"
            path.write_text(renderer("html")(page_of(folders(kind)), Page()))
            view, said, asked = chromium.new_page(viewport={"width": 1280, "height": 900}), [], []
            view.on("console", lambda message: said.append(message.text))
            view.on("pageerror", lambda error: said.append(str(error)))
            view.on("request", lambda request: asked.append(request.url))
            view.goto(path.as_uri())
            view.wait_for_function(DRAWN, timeout=60_000)
            opened[kind] = view, said, asked, path
        return opened[kind]

    return open_page


@pytest.mark.parametrize("kind", KINDS)
def test_every_plot_is_drawn_nothing_complains_and_nothing_leaves_the_page(kind, seen):
    view, said, asked, path = seen(kind)
    assert said == []
    assert asked == [path.as_uri()]
    plots = view.locator(".plot").count()
    assert plots > (0 if kind == "answers" else 1)
    marks = (
        ".role-mark path, .plot svg .role-mark line"
        if kind == "answers"
        else ".mark-rect path, .plot svg .mark-line path"
    )
    assert view.locator(f".plot[data-drawn=yes] svg {marks}").count() > 0
    empty = view.evaluate(
        "[...document.querySelectorAll('.plot')].filter(p => ![...p.querySelectorAll("
        "'.canvas svg .role-mark path, .canvas svg .role-mark line')].some(e => e.getBoundingClientRect().width > 0 "
        "|| e.getBoundingClientRect().height > 0)).map(p => p.querySelector('.title').textContent)"
    )
    assert empty == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("kind", KINDS)
def test_axe_has_no_serious_finding(kind, scheme, seen):
    from axe_playwright_python.sync_playwright import Axe

    view = seen(kind)[0]
    view.emulate_media(color_scheme=scheme)
    found = Axe().run(view).response["violations"]
    view.emulate_media(color_scheme="light")
    assert [(each["id"], each["nodes"][0]["html"]) for each in found if each["impact"] in ("serious", "critical")] == []


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("kind", KINDS)
def test_no_page_scrolls_sideways(kind, width, seen):
    view = seen(kind)[0]
    view.set_viewport_size({"width": width, "height": 844})
    assert view.evaluate("document.documentElement.scrollWidth") <= width
    view.set_viewport_size({"width": 1280, "height": 900})


@pytest.mark.parametrize("kind", KINDS)
def test_no_number_unit_or_option_is_broken_on_a_narrow_page(kind, seen):
    view = seen(kind)[0]
    view.set_viewport_size({"width": 390, "height": 844})
    broken = view.evaluate(
        "[...document.querySelectorAll('td.whole, th.whole, span.whole')].filter(each => {"
        " const range = document.createRange(); range.selectNodeContents(each);"
        " return new Set([...range.getClientRects()].map(line => Math.round(line.top))).size > 1; })"
        ".map(each => each.textContent)"
    )
    assert view.locator(".whole").count() > 0
    assert broken == []
    view.set_viewport_size({"width": 1280, "height": 900})


@pytest.mark.parametrize("kind", KINDS)
def test_no_name_is_taken_for_html(kind, seen):
    view = seen(kind)[0]
    assert view.evaluate("window.pwned") is None
    assert view.locator("img").count() == 0
    if kind in ("run", "monte-carlo", "comparison", "answers"):
        assert page_folders.NAME in view.locator("main").inner_text()


def test_the_numbers_of_a_run_are_those_of_its_json(folders, seen):
    view = seen("run")[0]
    saved = json.loads((folders("run") / "result.json").read_text())
    rows = view.locator("table").first.locator("tbody tr").all()
    assert len(rows) == 6
    for row, gain in zip(rows, saved["gains"], strict=True):
        cells = row.locator("th, td").all_inner_texts()
        assert cells[0] == str(gain["joint"])
        assert cells[1] == ("FAILED" if not gain["passed"] else "passed" if gain["identifiable"] else "refused")
        spread = 2.0 * gain["std"] if gain["identifiable"] else None
        assert cells[2] == rounded(gain["true"], spread)
        if gain["identifiable"]:
            assert cells[3] == rounded(gain["estimate"], spread)
            assert cells[4] == f"{200 * gain['std'] / abs(gain['estimate']):.2f}"
            assert cells[5] == f"{100 * gain['rel_error']:+.3f}"
        else:
            assert cells[3:5] == ["-", "-"]
    drawn = json.loads(view.locator("#plots").text_content())[0]["data"]["s1"]
    errors = {str(gain["joint"]): gain["rel_error"] for gain in saved["gains"] if gain["identifiable"]}
    assert dict(zip(drawn["x"], drawn["y"], strict=True)) == {
        # Plots keep five significant digits.
        joint: pytest.approx(100.0 * error, rel=6e-5)
        for joint, error in errors.items()
    }
    assert json.loads(view.locator("#document").text_content()) == saved


def test_a_plot_is_looked_at_more_closely_by_keyboard_and_given_back(seen):
    view = seen("run")[0]
    figure = view.locator(".plot", has=view.locator("button")).first

    def ticks() -> list[str]:
        labels = figure.locator(".canvas").first.locator(".role-axis-label text")
        return sorted(labels.all_text_contents())  # drawn in any order

    def press(what: str) -> None:
        figure.locator(f"button[data-do={what}]").press("Enter")

    before = ticks()
    press("in")
    closer = ticks()
    assert closer != before
    press("right")
    assert ticks() != closer
    press("all")
    assert ticks() == before


def test_plots_of_one_time_show_the_same_part_of_it(seen):
    view = seen("run")[0]
    figures = view.locator(".plot", has=view.locator("button"))
    figures.nth(1).locator("button[data-do=in]").press("Enter")
    spans = "[...document.querySelectorAll('.plot:has(button) .canvas')].map((each) => each.dataset.seen)"
    view.wait_for_function(f"{spans}[0] && new Set({spans}).size === 1")
    assert len(view.evaluate(spans)) == 2 * figures.count()  # residuals too
    figures.nth(1).locator("button[data-do=all]").press("Enter")


def test_a_folded_section_is_drawn_when_it_is_opened(seen):
    view = seen("run")[0]
    section = view.locator("details.section").first
    assert not section.locator(".canvas svg").first.is_visible()
    section.locator("summary").first.press("Enter")
    assert section.locator(".canvas svg").first.bounding_box()["width"] > 250
    section.locator("summary").first.press("Enter")


def test_the_numbers_of_a_plot_are_there_as_a_table(seen):
    view = seen("run")[0]
    figure = view.locator(".plot").first
    figure.locator("summary").press("Enter")
    view.wait_for_function("document.querySelector('.plot .numbers table')")
    table = figure.locator(".numbers tr").all_inner_texts()
    data = json.loads(view.locator("#plots").text_content())[0]["data"]
    assert len(table) == 1 + len(data["s0"]["x"]) + len(data["s1"]["x"])
    assert table[-1].split("\t")[1:] == [
        str(data["s1"][key][-1]).removesuffix(".0") for key in ("x", "y", "low", "high")
    ]


def test_a_run_fits_four_sheets_of_paper_its_plots_among_them(seen):
    view = seen("run")[0]
    paper = view.pdf(prefer_css_page_size=True)
    assert len(re.findall(rb"/Type\s*/Page\b(?!s)", paper)) <= 4
    assert view.locator(".canvas svg").count() == view.locator(".canvas").count() > view.locator(".plot").count()


@pytest.mark.slow  # the experiment is carried out twice
def test_the_page_of_the_paper_shows_its_tables_and_figure_3(tmp_path, chromium, capsys):
    assert main(["paper", "--out", str(tmp_path), "--seed", "2"]) == 0
    assert main(["report", str(tmp_path)]) == 0
    from axe_playwright_python.sync_playwright import Axe

    view, said = chromium.new_page(viewport={"width": 390, "height": 844}), []
    view.on("console", lambda message: said.append(message.text))
    view.goto((tmp_path / "report.html").as_uri())
    view.wait_for_function(DRAWN, timeout=60_000)
    assert said == []
    assert view.locator("h1 + p").inner_text() == "PASSED: all 9 claims hold."
    assert view.locator(".plot[data-drawn=yes]").count() == 6
    assert view.evaluate("document.documentElement.scrollWidth") <= 390
    found = Axe().run(view).response["violations"]
    assert [each["id"] for each in found if each["impact"] in ("serious", "critical")] == []
    document = json.loads(Path(tmp_path / "paper.json").read_text())["result"]
    mass = document["second_payload"]["payload"][-1]["estimate"]
    assert view.locator("table", has_text="paper").filter(has_text=f"{mass:.3f}").count() > 0
