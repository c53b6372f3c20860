"""Scenario files as TOML tables: names and places, and `extends`. Light imports: the command line checks names here.

An extending file replaces values key by key. Paths of robot and motions are relative to the file that names them.
"""

import os
from collections.abc import Mapping
from pathlib import Path

from ident.support.files import DEEPEST, LARGEST, check_file, read_toml
from ident.support.naming import nearest, one_line, shown
from scenarios.support.errors import ScenarioError, WrongValue

CATALOG = Path(__file__).parents[1] / "catalog"
"""Folder of the built-in scenarios."""
PARTS = CATALOG / "parts"
"""Folder of partial scenarios, which can be extended but not run."""
ROBOT = "rx90"
"""The default robot."""
MOTION = "experiment.motion"
BUILT_IN = {
    "robot": (ROBOT, *sorted(path.parent.name for path in CATALOG.glob("robots/*/robot.toml"))),
    MOTION: tuple(sorted(path.stem for path in CATALOG.glob("motions/*.toml"))),
}
"""Keys whose value is the path of a file or one of these names."""
LOADED = "loaded"
"""Name of the payload in key `payload` of plant and belief."""
SEEDS = 2**31
"""Upper bound of seeds of trials, exclusive."""

Table = dict[str, object]


def builtin_names() -> list[str]:
    """Names of the built-in scenarios."""
    return sorted(path.stem for path in CATALOG.glob("*.toml"))


def find_scenario(name: str, folder: Path | None = None) -> Path:
    """Return the path of a built-in scenario or a user's file, relative to the folder of the file that extends it."""
    if name in builtin_names():
        return CATALOG / f"{name}.toml"
    if name in {path.stem for path in PARTS.glob("*.toml")}:
        if folder is None:
            raise WrongValue(f"{name} is a partial scenario; extend it by a file that states the rest")
        return PARTS / f"{name}.toml"
    path = (folder or Path()) / name
    if path.suffix != ".toml" and not path.is_file():
        own = path / "scenario.toml"
        near = f"; did you mean {one_line(own)}?" if own.is_file() else nearest(name, builtin_names())
        raise WrongValue(f"unknown scenario {shown(name)}{near}; `rx90 list` shows all")
    if path.suffix != ".toml":
        from ident.model.arm import MODEL_FILES  # not at the top: it imports NumPy

        if path.suffix.lower() in MODEL_FILES:
            raise WrongValue(f"{one_line(path)} is a robot model; `rx90 new-robot` writes a scenario for it")
    check_file(path, most_bytes=LARGEST, error=ScenarioError)
    return path.resolve()


def scenario_table(name: str, folder: Path | None = None, below: tuple[Path, ...] = ()) -> tuple[Table, Path]:
    """Return a scenario merged with those that it extends, and its file; `below` are files already being read."""
    path = find_scenario(name, folder)
    if path in below:
        raise ScenarioError(f"{path}: extends itself through {' -> '.join(p.name for p in (*below, path))}")
    if len(below) >= DEEPEST:
        raise ScenarioError(f"{path}: more than {DEEPEST} files extend one another")
    table = read_toml(path, error=ScenarioError)
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
    return overlaid(seen_from(base, there.parent, path.parent), table), path


def seen_from(table: Mapping[str, object], beside: Path, folder: Path) -> Table:
    """Return a scenario's tables in folder `beside`, with paths relative to another folder."""

    def seen(place: object, key: str) -> object:
        if beside == folder or not isinstance(place, str) or place in BUILT_IN[key] or Path(place).is_absolute():
            return place
        return os.path.relpath(beside / place, folder)

    def of_draw(draw: object) -> object:
        if not isinstance(draw, Mapping) or not isinstance(draw.get("choice"), list):
            return draw
        targets = draw.get("target")
        if MOTION not in (targets if isinstance(targets, list) else [targets]):
            return draw
        return {**draw, "choice": [seen(each, MOTION) for each in draw["choice"]]}

    found, experiment = dict(table), _below(table, "experiment")
    if "robot" in found:
        found["robot"] = seen(found["robot"], "robot")
    if "motion" in experiment:
        found["experiment"] = {**experiment, "motion": seen(experiment["motion"], MOTION)}
    for group in ("random", "sources"):
        if isinstance(found.get(group), Mapping):
            found[group] = {name: of_draw(draw) for name, draw in _below(found, group).items()}
    return found


def overlaid(base: Mapping[str, object], over: Mapping[str, object]) -> Table:
    """Merge tables key by key; other values replace."""
    both = {
        key for key in base.keys() & over.keys() if isinstance(base[key], Mapping) and isinstance(over[key], Mapping)
    }
    return {**base, **over, **{key: overlaid(_below(base, key), _below(over, key)) for key in both}}


def _below(table: object, key: str) -> dict[str, object]:
    inner = table.get(key) if isinstance(table, Mapping) else None
    return dict(inner) if isinstance(inner, Mapping) else {}
