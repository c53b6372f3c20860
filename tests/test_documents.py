import ast
import importlib
import importlib.util
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import yaml
from places import ROOT
from recipes import RECIPES

DOCS = ROOT / "docs"
DOCUMENTS = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
MADE = "commands|scenario|robot|payload|result|ident|sim|scenarios"
GENERATED = re.compile(rf"(?:reference/(?:{MADE})|tutorial/python)\.md")
"""Pages that building the site makes; `make docs` checks links to them."""
PLACE = re.compile(r"`((?:ident|sim|scenarios|rx90_mjcf|tests|docs|bench)/[\w./-]*)`")
PACKAGES = ("ident", "sim", "scenarios", "rx90_mjcf")
SCRIPTS = sorted(path for folder in ("docs", "bench", "examples") for path in (ROOT / folder).rglob("*.py"))


def without_blocks(text: str) -> str:
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


def test_files_tests_and_names_that_documents_state_are_there():
    written = {place for recipe in RECIPES.values() for place in recipe.new}  # by the reader of a recipe
    tests = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    code = "\n".join(text for recipe in RECIPES.values() for text in recipe.new.values())
    for package in (*PACKAGES, "docs/adapters"):
        for path in (ROOT / package).rglob("*"):
            code += path.read_text(encoding="utf-8") if path.suffix in (".py", ".toml") else ""
    known = set(re.findall(r"\w+", code)) | set(re.findall(r"`(\w+)`", (DOCS / "notation.md").read_text("utf-8")))
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        assert {place for place in PLACE.findall(text) if not (ROOT / place).exists()} <= written, path
        for name in re.findall(r"`\[?([a-z]{2,}(?:_[a-z0-9]{3,})+)(?: = [^`]*)?\]?`", without_blocks(text)):
            assert f"def {name}(" in tests if name.startswith("test_") else name in known, (path, name)


@cache
def anchors(path: Path) -> set[str]:
    """Anchors of a document's headings, and those that it states."""
    text = without_blocks(path.read_text(encoding="utf-8"))
    titles = re.findall(r"^#+ (.*?)(?: \{#[\w-]+\})?$", text, re.MULTILINE)
    slugs = {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", title.lower())).strip("-") for title in titles}
    return slugs | set(re.findall(r"\{#([\w-]+)\}", text))


def test_every_link_within_the_project_leads_somewhere():
    for path in DOCUMENTS:
        for target in re.findall(r"\]\(([^)\s]+)\)", without_blocks(path.read_text(encoding="utf-8"))):
            place, _, anchor = target.partition("#")
            leads = (path.parent / place).resolve() if place else path
            if "://" in target or (leads.is_relative_to(DOCS) and GENERATED.fullmatch(str(leads.relative_to(DOCS)))):
                continue
            assert leads.exists(), (path, target)
            assert not anchor or anchor in anchors(leads), (path, target)


def pages(nav: object, title: str = "") -> dict[str, str]:
    """Pages of a navigation with their titles, however nested."""
    if isinstance(nav, str):
        return {nav: title}
    each = nav.items() if isinstance(nav, dict) else (("", member) for member in nav)
    return {place: name for key, member in each for place, name in pages(member, key).items()}


def test_every_document_is_in_the_navigation_of_the_site_under_its_heading():
    shown = pages(yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"])
    assert {str(p.relative_to(DOCS)) for p in DOCS.rglob("*.md")} == {p for p in shown if not GENERATED.fullmatch(p)}
    for place, title in shown.items():
        if (DOCS / place).exists() and title not in ("", "Home"):
            heading = re.search(r"^# (.*)$", (DOCS / place).read_text(encoding="utf-8"), re.MULTILINE)
            assert heading[1] == title, place


def dotted(node: ast.expr) -> str:
    """A name with attributes, empty where it is neither."""
    if isinstance(node, ast.Name):
        return node.id
    above = dotted(node.value) if isinstance(node, ast.Attribute) else ""
    return f"{above}.{node.attr}" if above else ""


def taken(code: str) -> Iterator[tuple[str, str]]:
    """What a script takes from our modules: module and name."""
    tree = ast.parse(code)
    imports = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    ours = {name for name in imports if name.split(".")[0] in PACKAGES}
    yield from ((name, "") for name in ours)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in PACKAGES:
            yield from ((str(node.module), each.name) for each in node.names)
        elif isinstance(node, ast.Attribute) and dotted(node.value) in ours:
            yield dotted(node.value), node.attr


def there(module: str, name: str) -> bool:
    try:
        if importlib.util.find_spec(module) is None:
            return False
        return not name or hasattr(importlib.import_module(module), name) or there(f"{module}.{name}", "")
    except ModuleNotFoundError:  # what stands before the last dot is none, or no package
        return False


def test_everything_that_scripts_take_from_the_packages_is_there():
    for path in SCRIPTS:
        missing = [each for each in taken(path.read_text(encoding="utf-8")) if not there(*each)]
        assert missing == [], path
    code = "import sim.record\nimport scenarios.nowhere\nfrom ident import payload, Cargo\nsim.record._gone = 1\n"
    gone = [("ident", "Cargo"), ("scenarios.nowhere", ""), ("sim.record", "_gone")]
    assert sorted(each for each in taken(code) if not there(*each)) == gone


def test_the_real_weighing_of_the_readme_is_that_of_the_page_that_is_made_from_recordings():
    (told,) = re.findall(
        r"^\*\*On a real robot\.\*\*.*?\n\n", ROOT.joinpath("README.md").read_text("utf-8"), re.M | re.S
    )
    page = (DOCS / "real-robots.md").read_text("utf-8")
    rows = {tuple(line.strip("| ").split(" | ")[:2]): line.strip("| ").split(" | ")[3:] for line in page.splitlines()}
    weighed, found = rows["January", "nls"]
    _, published = rows["January", "published"]
    assert f"{weighed} kg on the\nscale, as {found} kg (2 sigma)" in told
    mass = published.split(" ± ")[0]
    assert f"weigh {mass} kg, {100.0 * (float(mass) / float(weighed) - 1.0):.1f} % too much" in told
