"""What documents name is there: files, tests, names of code."""

import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
import yaml
from places import ROOT
from recipes import RECIPES

DOCS = ROOT / "docs"
DOCUMENTS = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
MADE = "commands|scenario|robot|payload|result|ident|sim|scenarios"
GENERATED = re.compile(rf"(?:reference/(?:{MADE})|tutorial/python)\.md")
"""Pages that building the site makes; `make docs` checks links to them."""
WRITTEN = {place for recipe in RECIPES.values() for place in recipe.new}
"""Files that a reader of a recipe writes."""
PLACE = re.compile(r"`((?:ident|sim|scenarios|rx90_mjcf|tests|docs|bench)/[\w./-]*)`")
TESTS = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
CODE = "\n".join(
    path.read_text(encoding="utf-8")
    for package in ("ident", "sim", "scenarios", "rx90_mjcf", "docs/adapters")
    for path in (ROOT / package).rglob("*")
    if path.suffix in (".py", ".toml")
)
SYMBOLS = (ROOT / "docs" / "notation.md").read_text(encoding="utf-8")


def without_blocks(text: str) -> str:
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_file_that_a_document_names_is_there(path):
    missing = {place for place in PLACE.findall(path.read_text(encoding="utf-8")) if not (ROOT / place).exists()}
    assert missing <= WRITTEN


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_test_that_a_document_names_is_one(path):
    for name in re.findall(r"`(test_\w+)`", path.read_text(encoding="utf-8")):
        assert f"def {name}(" in TESTS, name


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_name_with_an_underscore_is_in_the_code(path):
    text = path.read_text(encoding="utf-8")
    written = "\n".join(code for recipe in RECIPES.values() for code in recipe.new.values())
    known = CODE + written if path.parent.name == "extending" else CODE
    for name in re.findall(r"`\[?([a-z]{2,}(?:_[a-z0-9]{3,})+)(?: = [^`]*)?\]?`", without_blocks(text)):
        if not name.startswith("test_") and f"`{name}`" not in SYMBOLS:
            assert re.search(rf"\b{name}\b", known), name


@cache
def anchors(path: Path) -> set[str]:
    """Anchors of a document's headings, and those that it states."""
    text = without_blocks(path.read_text(encoding="utf-8"))
    titles = re.findall(r"^#+ (.*?)(?: \{#[\w-]+\})?$", text, re.MULTILINE)
    slugs = {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", title.lower())).strip("-") for title in titles}
    return slugs | set(re.findall(r"\{#([\w-]+)\}", text))


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_link_within_the_project_leads_somewhere(path):
    for target in re.findall(r"\]\(([^)\s]+)\)", without_blocks(path.read_text(encoding="utf-8"))):
        if "://" in target:
            continue
        place, _, anchor = target.partition("#")
        leads = (path.parent / place).resolve() if place else path
        if leads.is_relative_to(DOCS) and GENERATED.fullmatch(leads.relative_to(DOCS).as_posix()):
            continue
        assert leads.exists(), target
        assert not anchor or anchor in anchors(leads), target


def places(nav: object) -> set[str]:
    """Pages of a navigation, however nested."""
    if isinstance(nav, str):
        return {nav}
    return set().union(*map(places, nav.values() if isinstance(nav, dict) else nav))


def test_every_document_is_in_the_navigation_of_the_site():
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    held = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")}
    shown = places(yaml.safe_load(text)["nav"])
    assert held == {place for place in shown if not GENERATED.fullmatch(place)}


def titles(nav: object) -> dict[str, str]:
    """What a navigation calls each page, however nested."""
    if isinstance(nav, str):
        return {}
    if isinstance(nav, list):
        return {place: title for each in nav for place, title in titles(each).items()}
    found = [{nav[title]: title} if isinstance(nav[title], str) else titles(nav[title]) for title in nav]
    return {place: title for each in found for place, title in each.items()}


def test_the_navigation_calls_a_page_as_its_heading_does():
    nav = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    called = {place: title for place, title in titles(nav).items() if (DOCS / place).exists() and title != "Home"}
    assert len(called) > 40
    for place, title in called.items():
        heading = re.search(r"^# (.*)$", (DOCS / place).read_text(encoding="utf-8"), re.MULTILINE)
        assert heading[1] == title, place


def test_the_rates_on_the_page_of_studies_are_those_of_the_page_on_coverage():
    page = (
        (ROOT / "docs" / "coverage.md").read_text(encoding="utf-8").split("## nominal, 300 trials")[1].split("\n## ")[0]
    )
    expected = []
    for line in page.splitlines():
        row = [cell.strip() for cell in line.strip("|").split("|")]
        if row[0].isdigit() and row[1] != "0":
            joint, bias, spread, below, one, two = (row[k].split()[0] for k in (0, 4, 5, 6, 8, 9))
            expected.append(f"| {joint} | {bias} | {spread} | {below} | {one} | {two} |")
    assert len(expected) == 5
    studies = (DOCS / "how-to" / "studies.md").read_text(encoding="utf-8")
    assert "\n".join(expected) in studies
    assert "rx90 monte-carlo nominal -n 300" in studies


def test_protocols_differ_in_what_is_mounted_and_draw_the_same():
    one, two = (
        tomllib.loads((ROOT / "docs" / "protocols" / f"{name}.toml").read_text(encoding="utf-8"))
        for name in ("return", "two-weights")
    )
    assert one["random"] == two["random"]
    assert one["experiment"]["pause"] == two["experiment"]["pause"]
    assert len(one["random"]) == 3
