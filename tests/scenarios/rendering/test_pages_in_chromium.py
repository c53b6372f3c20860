import importlib.util
import shutil
from functools import cache
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
    """The folder of a kind, made when it is first asked for."""

    def new(name: str) -> Path:
        return tmp_path_factory.mktemp(f"{name} here")

    @cache
    def folder(kind: str) -> Path:
        made = {
            "run": lambda: page_folders.run(new("run")),
            "identification": lambda: page_folders.identification(new("more") / "again", folder("run")),
            "check": lambda: page_folders.check(new("more") / "check", folder("run")),
            "monte-carlo": lambda: page_folders.study(new("study")),
            "sensitivity": lambda: page_folders.budget(new("budget")),
            "comparison": lambda: page_folders.comparison(new("more") / "comparison"),
        }[kind]()
        assert kind_of(made) == kind
        return made

    return folder


@pytest.fixture(scope="module")
def chromium():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_complete_without_a_script_asks_for_nothing_and_is_read_by_everybody(kind, folders, chromium):
    from axe_playwright_python.sync_playwright import Axe

    path = folders(kind) / "report.html"
    path.write_text(renderer("html")(page_of(folders(kind)), Page()))
    view, said, asked = chromium.new_page(viewport={"width": 1280, "height": 900}), [], []
    view.on("console", lambda message: said.append(message.text))
    view.on("pageerror", lambda error: said.append(str(error)))
    view.on("request", lambda request: asked.append(request.url))
    view.goto(path.as_uri())
    assert view.locator("script:not([type='application/json'])").count() == 0
    assert view.locator(".plot svg").count() == view.locator(".plot").count() > 1
    assert view.evaluate("window.pwned") is None
    assert view.locator("img").count() == 0
    if kind in ("run", "monte-carlo", "comparison"):
        assert page_folders.NAME in view.locator("main").inner_text()
    colours, serious = set(), []
    for scheme in ("dark", "light"):
        view.emulate_media(color_scheme=scheme)
        colours.add(view.evaluate("getComputedStyle(document.querySelector('.plot svg text')).fill"))
        found = [each for each in Axe().run(view).response["violations"] if each["impact"] in ("serious", "critical")]
        serious += [(each["id"], each["nodes"][0]["html"]) for each in found]
    assert (len(colours), serious, said, asked) == (2, [], [], [path.as_uri()])
    for width in (1280, 390):  # a narrow page scrolls not sideways, and breaks no number, unit or option
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
