import ast
import subprocess
import sys
from functools import cache

import pytest
from places import ROOT

ALLOWED = {
    "rx90_mjcf": {"rx90_mjcf"},
    "ident": {"ident"},
    "sim": {"sim", "rx90_mjcf", "ident.recordings.recording"}
    | {f"ident.support.{name}" for name in ("arrays", "errors", "options", "files", "naming")}
    | {f"ident.numerics.{name}" for name in ("filters", "splines")},
    "scenarios": {"scenarios", "sim", "ident", "rx90_mjcf"},
}
FOLDERS = {
    "ident": "support numerics model payload recordings observation estimation parameters diagnosis",
    "scenarios": "support rendering experiments results prediction design gains_in_use benchmark command_line commands",
}
"""From the ground up: a folder imports from itself and from those before it."""
DATA = {"catalog", "schemas"}
OURS = set(ALLOWED)
FILES = [path for package in ALLOWED for path in sorted((ROOT / package).rglob("*.py"))]


@cache
def nodes(path) -> list[ast.Import | ast.ImportFrom | ast.Raise]:
    kinds = (ast.Import, ast.ImportFrom, ast.Raise)
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, kinds)]


@cache
def imported(path) -> set[str]:
    names: set[str] = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            names |= {node.module}
    return names


def test_packages_import_one_way():
    for path in FILES:
        package = path.relative_to(ROOT).parts[0]
        for name in imported(path):
            if name.split(".")[0] in OURS:
                allowed = any(name == a or name.startswith(f"{a}.") for a in ALLOWED[package])
                assert allowed, f"{path.relative_to(ROOT)} may not import {name}"
            if package == "ident" and (path.name, name) != ("display.py", "pandas"):  # when a data frame is asked for
                assert name.split(".")[0] not in ("mujoco", "pandas"), f"{path.relative_to(ROOT)} may not import {name}"


@pytest.mark.parametrize("package", FOLDERS)
def test_folders_import_one_way(package):
    order = FOLDERS[package].split()
    there = {path.parent.name for path in FILES if path.parent.parent == ROOT / package} - DATA
    assert there <= set(order), f"{package} has folders that no order names: {there - set(order)}"
    for path in FILES:
        if path.is_relative_to(ROOT / package) and path.parent != ROOT / package:
            own = order.index(path.relative_to(ROOT / package).parts[0])
            for name in imported(path):
                parts = name.split(".")
                if parts[0] == package and len(parts) > 1:
                    assert parts[1] in order[: own + 1], f"{path.relative_to(ROOT)} may not import {name}"


def test_only_the_engine_touches_mujoco_batch():
    assert [p.relative_to(ROOT).as_posix() for p in FILES if "mujoco.batch" in imported(p)] == ["sim/engine.py"]


def test_no_circle_of_imports():
    modules = {
        p.relative_to(ROOT).with_suffix("").as_posix().replace("/", ".").removesuffix(".__init__"): p for p in FILES
    }
    edges = {name: {m for m in imported(path) if m in modules and m != name} for name, path in modules.items()}
    while edges:
        free = [name for name, targets in edges.items() if not targets & edges.keys()]
        assert free, f"these import each other in a circle: {sorted(edges)}"
        for name in free:
            del edges[name]


def test_ident_works_without_mujoco_pandas_and_the_rest_of_the_project():
    code = (
        "import sys, pkgutil, importlib\n"
        "for name in ('mujoco', 'pandas', 'sim', 'scenarios', 'rx90_mjcf'): sys.modules[name] = None\n"
        "import ident\n"
        "for module in pkgutil.walk_packages(ident.__path__, 'ident.'): importlib.import_module(module.name)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_no_base_class_of_errors_is_raised():
    bases = {"ProjectError", "IdentificationError", "SimulationError"}
    for path in FILES:
        for node in nodes(path):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name):
                assert node.exc.func.id not in bases, f"{path.relative_to(ROOT)}:{node.lineno} raises a base class"
