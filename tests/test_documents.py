"""What documents name is there: files, tests, names of code."""

import re
import tomllib

import pytest
from places import ROOT
from recipes import RECIPES

DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
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


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_file_that_a_document_names_is_there(path):
    missing = {place for place in PLACE.findall(path.read_text(encoding="utf-8")) if not (ROOT / place).exists()}
    assert missing <= WRITTEN


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_test_that_a_document_names_is_one(path):
    for name in re.findall(r"`(test_\w+)`", path.read_text(encoding="utf-8")):
        assert f"def {name}(" in TESTS, name


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_name_with_an_underscore_is_in_the_code(path):
    text = path.read_text(encoding="utf-8")
    written = "\n".join(code for recipe in RECIPES.values() for code in recipe.new.values())
    known = CODE + written if path.name == "extending.md" else CODE
    for name in re.findall(r"`\[?([a-z]{2,}(?:_[a-z0-9]{3,})+)(?: = [^`]*)?\]?`", without_blocks(text)):
        if not name.startswith("test_") and f"`{name}`" not in SYMBOLS:
            assert re.search(rf"\b{name}\b", known), name


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_within_the_project_leads_somewhere(path):
    text = path.read_text(encoding="utf-8")
    headings = {title.lower().replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}
    for target in re.findall(r"\]\(([^)\s]+)\)", without_blocks(text)):
        if target.startswith("#"):
            assert target[1:] in headings, target
        elif "://" not in target:
            assert (path.parent / target).exists(), target


def test_every_document_is_named_in_the_readme():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for path in DOCUMENTS[1:]:
        assert f"docs/{path.name}" in readme


def test_the_rates_in_the_readme_are_those_of_the_page_on_coverage():
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
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\n".join(expected) in readme
    assert "rx90 monte-carlo nominal -n 300" in readme


def test_protocols_differ_in_what_is_mounted_and_draw_the_same():
    one, two = (
        tomllib.loads((ROOT / "docs" / "protocols" / f"{name}.toml").read_text(encoding="utf-8"))
        for name in ("return", "two-weights")
    )
    assert one["random"] == two["random"]
    assert one["experiment"]["pause"] == two["experiment"]["pause"]
    assert len(one["random"]) == 3
