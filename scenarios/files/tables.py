"""TOML tables: reading, overlaying one on another (`extends`), and naming the nearest known key."""

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

from scenarios.errors import ScenarioError

CATALOG = Path(__file__).parents[1] / "catalog"
"""Folder of the built-in scenarios."""


def builtin_names() -> list[str]:
    """Names of the built-in scenarios."""
    return sorted(path.stem for path in CATALOG.glob("*.toml"))


def read_table(path: Path) -> dict[str, object]:
    """Parse a TOML file.

    Raises:
        ScenarioError: If it is missing or no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror or 'not readable'}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from error


def scenario_table(
    name: str, folder: Path | None = None, below: tuple[Path, ...] = ()
) -> tuple[dict[str, object], Path]:
    """Read a scenario with everything it extends overlaid, most basic first.

    Args:
        name: A built-in name, or the path of a TOML file.
        folder: What a relative path is relative to; the working folder if None.
        below: Files already being read, to catch a circle.

    Returns:
        The merged table without `extends`, and the file it came from.

    Raises:
        ScenarioError: If a file is missing or no TOML, or `extends` runs in a circle.
    """
    path = find_scenario(name, folder)
    if path in below:
        raise ScenarioError(f"{path}: extends itself through {' -> '.join(p.name for p in (*below, path))}")
    table = read_table(path)
    parent = table.pop("extends", None)
    if parent is None:
        return table, path
    if not isinstance(parent, str):
        raise ScenarioError(f"{path}: extends = {parent!r}; expected the name of one scenario")
    try:
        base, _ = scenario_table(parent, path.parent, (*below, path))
    except ScenarioError as error:
        if below or str(error).startswith(str(path)):
            raise
        raise ScenarioError(f"{path}: extends: {error}") from error
    return overlaid(base, table), path


def find_scenario(name: str, folder: Path | None = None) -> Path:
    """Path of a built-in scenario or of a user's file.

    Raises:
        ScenarioError: If there is neither; names the nearest built-in one.
    """
    if name in builtin_names():
        return CATALOG / f"{name}.toml"
    path = (folder or Path()) / name
    if path.is_file():
        return path.resolve()
    if path.suffix == ".toml":
        raise ScenarioError(f"{path}: no such file")
    raise ScenarioError(f"unknown scenario {name!r}{nearest(name, builtin_names())}; `rx90 list` shows all")


def overlaid(base: Mapping[str, object], over: Mapping[str, object]) -> dict[str, object]:
    """Overlay tables on tables, key by key; anything else replaces what was there."""
    merged = dict(base)
    for key, value in over.items():
        old = merged.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            merged[key] = overlaid(old, value)
        else:
            merged[key] = value
    return merged


def nearest(key: str, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` for the nearest known key, empty if none is near."""
    close = difflib.get_close_matches(key, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else ""
