"""Scripts of docs, bench and examples, which few tests run: what they take from the packages is there."""

import ast
import importlib
import importlib.util
from collections.abc import Iterator
from pathlib import Path

import pytest
from places import ROOT

PACKAGES = ("ident", "sim", "scenarios", "rx90_mjcf")
SCRIPTS = sorted(path for folder in ("docs", "bench", "examples") for path in (ROOT / folder).rglob("*.py"))


def modules(tree: ast.AST) -> Iterator[str]:
    """Our modules that a script imports by name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name.split(".")[0] in PACKAGES)


def dotted(node: ast.expr) -> str:
    """A name with attributes, empty where it is neither."""
    if isinstance(node, ast.Name):
        return node.id
    above = dotted(node.value) if isinstance(node, ast.Attribute) else ""
    return f"{above}.{node.attr}" if above else ""


def missing(code: str) -> list[str]:
    """What a script takes from our modules and they do not have."""
    tree = ast.parse(code)
    named = set(modules(tree))
    taken = {(name, "") for name in named}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in PACKAGES:
            taken |= {(node.module, each.name) for each in node.names}
        elif isinstance(node, ast.Attribute) and dotted(node.value) in named:
            taken |= {(dotted(node.value), node.attr)}
    return sorted(f"{module}.{name}".rstrip(".") for module, name in taken if not _there(module, name))


def _there(module: str, name: str) -> bool:
    if not _is_module(module):
        return False
    return not name or hasattr(importlib.import_module(module), name) or _is_module(f"{module}.{name}")


def _is_module(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except ModuleNotFoundError:  # what stands before the last dot is none, or no package
        return False


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_everything_that_a_script_takes_from_the_packages_is_there(path: Path):
    assert missing(path.read_text(encoding="utf-8")) == []


def test_what_is_not_there_is_named():
    code = (
        "import sim.record\nimport scenarios.nowhere\n"
        "from ident.payload.payload import Payload, Cargo\nfrom ident import payload\n"
        "sim.record._gone = sim.record.record(sim.record.logged)\n"
    )
    assert missing(code) == ["ident.payload.payload.Cargo", "scenarios.nowhere", "sim.record._gone"]
