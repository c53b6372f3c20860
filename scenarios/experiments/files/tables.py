"""Reading of TOML tables, and merging of extended files (`extends`)."""

from collections.abc import Mapping
from pathlib import Path

from ident.support.file_access import check_file
from ident.support.naming import nearest, one_line, shown
from ident.support.toml_files import DEEPEST, LARGEST, read_toml
from scenarios.experiments.files.exactness import check_exact, exactness
from scenarios.experiments.files.places import CATALOG, seen_from
from scenarios.support.errors import ScenarioError, UnknownName, UnreadableFile

PARTS = CATALOG / "parts"
"""Folder of partial scenarios, which can be extended but not run."""


def part_names() -> list[str]:
    """Names of partial scenarios."""
    return sorted(path.stem for path in PARTS.glob("*.toml"))


def builtin_names() -> list[str]:
    """Names of the built-in scenarios."""
    return sorted(path.stem for path in CATALOG.glob("*.toml"))


def read_table(path: Path) -> dict[str, object]:
    """Parse a TOML file.

    Raises:
        UnreadableFile: If it is missing or not TOML.
    """
    return read_toml(path, error=UnreadableFile)


def scenario_table(
    name: str, folder: Path | None = None, below: tuple[Path, ...] = ()
) -> tuple[dict[str, object], Path]:
    """Read a scenario merged with the scenarios that it extends.

    Args:
        name: A built-in name, or the path of a TOML file.
        folder: Base of relative paths; the working folder if None.
        below: Files already being read, to detect circles.

    Returns:
        The merged table without `extends`, with paths relative to the file's folder, and the file.

    Raises:
        ScenarioError: If a file is missing or not TOML, or `extends` is circular.
    """
    path = find_scenario(name, folder)
    if path in below:
        raise ScenarioError(f"{path}: extends itself through {' -> '.join(p.name for p in (*below, path))}")
    if len(below) >= DEEPEST:
        raise ScenarioError(f"{path}: more than {DEEPEST} files extend one another")
    table = read_table(path)
    check_exact(table, path)
    parent = table.pop("extends", None)
    if parent is None:
        return table, path
    if not isinstance(parent, str):
        raise ScenarioError(f"{path}: extends = {shown(parent)}; expected the name of one scenario")
    try:
        base, there = scenario_table(parent, path.parent, (*below, path))
    except ScenarioError as error:
        if below or str(error).startswith(str(path)):
            raise
        raise ScenarioError(f"{path}: extends: {error}") from error
    base = seen_from(base, there.parent, path.parent)
    merged, exact = overlaid(base, table), exactness(base, table)
    return (merged if exact is None else overlaid(merged, {"belief": {"exact": exact}})), path


def stating_file(name: str, keys: tuple[str, ...], folder: Path | None = None) -> Path | None:
    """Return the file that states a key: the scenario's own, or the nearest extended one; None if none does.

    The files must have been read before; `keys` is the path of the key.
    """
    path = find_scenario(name, folder)
    table = read_table(path)
    inner: object = table
    for key in keys:
        inner = inner.get(key) if isinstance(inner, Mapping) else None
    parent = table.get("extends")
    if inner is None and isinstance(parent, str):
        return stating_file(parent, keys, path.parent)
    return None if inner is None else path


def find_scenario(name: str, folder: Path | None = None) -> Path:
    """Return the path of a built-in scenario or of a user's file.

    Raises:
        ScenarioError: If it does not exist; the message names the nearest built-in one.
    """
    if name in builtin_names():
        return CATALOG / f"{name}.toml"
    if name in part_names():
        if folder is None:
            raise UnknownName(f"{name} is a partial scenario; extend it by a file that states the rest")
        return PARTS / f"{name}.toml"
    path = (folder or Path()) / name
    if path.suffix != ".toml" and not path.is_file():
        own = path / "scenario.toml"
        near = f"; did you mean {one_line(own)}?" if own.is_file() else nearest(name, builtin_names())
        raise UnknownName(f"unknown scenario {shown(name)}{near}; `rx90 list` shows all")
    if path.suffix != ".toml" and _is_model(path):
        raise UnknownName(f"{one_line(path)} is a robot model; `rx90 new-robot` writes a scenario for it")
    check_file(path, most_bytes=LARGEST, error=UnreadableFile)
    return path.resolve()


def _is_model(path: Path) -> bool:
    from ident.model.files import MODEL_FILES  # not at the top: it imports NumPy

    return path.suffix.lower() in MODEL_FILES


def overlaid(base: Mapping[str, object], over: Mapping[str, object]) -> dict[str, object]:
    """Merge tables key by key; other values replace."""
    merged = dict(base)
    for key, value in over.items():
        old = merged.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            merged[key] = overlaid(old, value)
        else:
            merged[key] = value
    return merged
