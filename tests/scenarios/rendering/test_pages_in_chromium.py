import importlib.util
import shutil
from pathlib import Path

import page_folders
import pytest

from scenarios.rendering import Page, renderer
from scenarios.results.pages import kind_of, page_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MISSING = [name for name in ("playwright", "axe_playwright_python") if importlib.util.find_spec(name) is None]
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or bool(MISSING), reason=f"needs {', '.join(MISSING) or 'a Chromium in the path'}"
)
MORE = ("comparison", "identification", "check", "monte-carlo", "sensitivity")
KINDS = ["run", *(pytest.param(kind, marks=pytest.mark.slow) for kind in MORE)]


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
            opened[kind] = view, said, asked, path
        return opened[kind]

    return open_page


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_complete_without_a_script_and_asks_for_nothing(kind, seen):
    view, said, asked, path = seen(kind)
    assert said == []
    assert asked == [path.as_uri()]
    assert view.locator("script:not([type='application/json'])").count() == 0
    assert view.locator(".plot svg").count() == view.locator(".plot").count() > 1
    assert view.evaluate("window.pwned") is None
    assert view.locator("img").count() == 0
    if kind in ("run", "monte-carlo", "comparison"):
        assert page_folders.NAME in view.locator("main").inner_text()
    colours = []
    for scheme in ("dark", "light"):
        view.emulate_media(color_scheme=scheme)
        style = "getComputedStyle(document.querySelector('.plot svg text')).fill"
        colours.append(view.evaluate(style))
    assert len(set(colours)) == 2


@pytest.mark.parametrize(
    "kind", ["comparison", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("run", *MORE[1:]))]
)
def test_axe_has_no_serious_finding(kind, seen):
    from axe_playwright_python.sync_playwright import Axe

    view = seen(kind)[0]
    for scheme in ("dark", "light"):
        view.emulate_media(color_scheme=scheme)
        found = [each for each in Axe().run(view).response["violations"] if each["impact"] in ("serious", "critical")]
        assert [(each["id"], each["nodes"][0]["html"]) for each in found] == []


@pytest.mark.parametrize("kind", KINDS)
def test_a_narrow_page_scrolls_not_sideways_and_breaks_no_number_unit_or_option(kind, seen):
    view = seen(kind)[0]
    for width in (1280, 390):
        view.set_viewport_size({"width": width, "height": 844})
        assert view.evaluate("document.documentElement.scrollWidth") <= width
    broken = view.evaluate(
        "[...document.querySelectorAll('td.whole, th.whole, span.whole')].filter(each => {"
        " const range = document.createRange(); range.selectNodeContents(each);"
        " return new Set([...range.getClientRects()].map(line => Math.round(line.top))).size > 1; })"
        ".map(each => each.textContent)"
    )
    assert view.locator(".whole").count() > 0
    assert broken == []
    view.set_viewport_size({"width": 1280, "height": 900})
