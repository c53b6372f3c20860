"""The site is built from pages and code: what is generated is whole, and the build has nothing to complain of."""

import importlib.util
import os
import re
import runpy
import shutil
import subprocess
import sys
from functools import cache
from xml.etree import ElementTree as ET

import pytest
from places import ROOT

from scenarios.commands import GROUPS
from scenarios.results.json_schemas import FILES, RESULTS
from scenarios.results.json_schemas import schema as schema_of

SITE = ROOT / "docs" / "site"
MATHML = "{http://www.w3.org/1998/Math/MathML}"


@cache
def made(name: str) -> dict:
    """What a module of docs/site has."""
    return runpy.run_path(str(SITE / f"{name}.py"))


def test_equations_are_set_as_mathml_in_a_line_and_by_themselves():
    html = r'<p><span class="arithmatex">\(g_j &lt; 2\)</span></p><div class="arithmatex">\[ \frac{a}{b} \]</div>'
    within, alone = ET.fromstring(f"<body>{made('equations')['typeset'](html)}</body>").iter(f"{MATHML}math")
    assert (within.get("display"), alone.get("display")) == ("inline", "block")
    assert [part.text for part in within.find(f".//{MATHML}msub")] == ["g", "j"]
    assert within.find(f".//{MATHML}mo").text == "<"
    assert [part.text for part in alone.iter(f"{MATHML}mi")] == ["a", "b"]


def test_every_command_has_a_section_with_its_options():
    page = made("command_pages")["commands_page"]()
    titles = [*(name.capitalize() for name in GROUPS), "Exit statuses"]
    assert re.findall(r"^## (.+)$", page, re.MULTILINE) == titles
    for group, members in GROUPS.items():
        section = page.partition(f"\n## {group.capitalize()}\n")[2].partition("\n## ")[0]
        assert re.findall(r"^### rx90 (\S+)$", section, re.MULTILINE) == list(members)
    section = page.partition("### rx90 predict\n")[2].partition("\n### ")[0]
    assert re.search(r"^\| `SCENARIO` \| .*error sources \|$", section, re.MULTILINE)
    assert re.search(r"^\| `--option KEY=VALUE` \| .*repeatable \|$", section, re.MULTILINE)


def test_keys_are_told_with_unit_bounds_default_and_what_nominal_has():
    pages = made("key_pages")["key_pages"]()
    what = "Standard deviation of a reading before quantisation"
    row = f"| `encoder_noise` | {what} | number ≥ 0, ≤ 1 | rad | `0.0` | `2e-06` |"
    assert row in pages["reference/scenario.md"]
    for name in FILES | RESULTS:
        schema = schema_of(name)
        page = next(text for text in pages.values() if f"## {made('key_pages')['heading'](name)}\n" in text)
        for table in (schema, *schema.get("$defs", {}).values()):
            for key in table.get("properties", {}):
                assert f"| `{key}` |" in page, f"{table['title']}.{key}"


def test_every_module_that_a_package_exports_from_is_on_its_page():
    pages = made("api")["api_pages"]()
    for package in ("ident", "scenarios"):
        exported = re.findall(r"^from \.([\w.]+) import", (ROOT / package / "__init__.pyi").read_text(), re.MULTILINE)
        for module in exported:
            assert f"::: {package}.{module}\n" in pages[f"reference/{package}.md"]
    for module in re.findall(r"^::: (\S+)$", "".join(pages.values()), re.MULTILINE):
        assert importlib.util.find_spec(module), module


@pytest.mark.slow
def test_the_page_of_the_notebook_has_its_words_its_cells_and_its_picture():
    notebook = ROOT / "examples" / "case.py"
    page = made("notebook")["notebook_page"](notebook)
    assert re.findall(r"^#+ (.*)$", page, re.MULTILINE) == [
        "A case from Python",
        "Record",
        "Identify",
        "Judge",
        "Spoil it",
        "Repeat",
    ]
    cells = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    hidden = notebook.read_text().count("hide_code=True")
    assert len(cells) == notebook.read_text().count("@app.cell") - hidden
    assert page.index("figure.supxlabel") < page.index("![Currents") < page.index("## Identify")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(site):
    assert "<math" in (site / "explanation" / "method.html").read_text(encoding="utf-8")
    for page in site.rglob("*.html"):  # nothing is loaded from elsewhere
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|source)[^>]*\bsrc="(http[^"]*)"', text)
        loaded += re.findall(r'<link[^>]*\brel="(?:stylesheet|preconnect|icon)"[^>]*\bhref="(http[^"]*)"', text)
        assert not loaded, page


@pytest.fixture(scope="module")
def chromium():
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("needs a Chromium in the path")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.mark.slow
def test_the_site_is_searched_in_a_folder_without_a_server(site, chromium):
    view, said = chromium.new_page(viewport={"width": 1280, "height": 900}), []
    view.on("console", lambda message: said.append(message.text))
    view.on("pageerror", lambda error: said.append(str(error)))
    view.goto((site / "tutorial" / "rx90.html").as_uri())
    view.locator(".md-search__input").click()
    view.keyboard.type("armature")
    view.wait_for_selector(".md-search-result__link", timeout=30_000)
    assert re.match(r"\d+ matching documents", view.locator(".md-search-result__meta").inner_text())
    assert said == []


@pytest.mark.slow
def test_no_table_is_cut_at_1280_pixels_and_no_page_scrolls_sideways(site, chromium):
    cut = (
        "[...document.querySelectorAll('.md-typeset__scrollwrap')].filter((e) => e.scrollWidth > e.clientWidth).length"
    )
    for width in (1280, 390):
        view = chromium.new_page(viewport={"width": width, "height": 900})
        for page in site.rglob("*.html"):
            view.goto(page.as_uri())
            assert view.evaluate("document.documentElement.scrollWidth") <= width, page.name
            assert width < 1280 or view.evaluate(cut) == 0, page.name
        view.close()


@pytest.mark.slow
def test_the_notebook_runs_and_comes_to_what_it_says():
    app = runpy.run_path(str(ROOT / "examples" / "case.py"), run_name="case")["app"]
    _, defined = app.run()
    identified = defined["right"][:5]
    assert abs(identified).max() < 1.5  # percent; five deviations of the widest of them
    assert abs(defined["shift"] - 3.0) < 0.1  # the weight is 3 % off, and what it leaves of friction's share
