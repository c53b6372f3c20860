import importlib.util
import os
import re
import runpy
import subprocess
import sys
from functools import cache

import pytest
from places import ROOT

from scenarios.results.json_schemas import FILES, RESULTS
from scenarios.results.json_schemas import schema as schema_of

SITE = ROOT / "docs" / "site"


@cache
def made(name: str) -> dict:
    """What a module of docs/site has."""
    return runpy.run_path(str(SITE / f"{name}.py"))


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
    assert "<th>gain [N m/unit]</th>" in (site / "tutorial" / "python.html").read_text(encoding="utf-8")
    for page in site.rglob("*.html"):  # nothing is loaded from elsewhere
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|img|source)[^>]*\bsrc="(http[^"]*)"', text)
        loaded += re.findall(r'<link[^>]*\brel="(?:stylesheet|preconnect|icon)"[^>]*\bhref="(http[^"]*)"', text)
        assert not loaded, page


@pytest.mark.slow
def test_the_notebook_runs_and_comes_to_what_it_says():
    app = runpy.run_path(str(ROOT / "examples" / "case.py"), run_name="case")["app"]
    _, defined = app.run()
    identified = defined["right"][:5]
    assert abs(identified).max() < 1.5  # percent; five deviations of the widest of them
    assert abs(defined["shift"] - 3.0) < 0.1  # the weight is 3 % off, and what it leaves of friction's share
