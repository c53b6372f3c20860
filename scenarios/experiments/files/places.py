"""Files of robot and motions: their paths are relative to the file that names them, even if that file is extended."""

import os
from collections.abc import Mapping
from pathlib import Path

ROBOT = "rx90"
"""The default robot."""
CATALOG = Path(__file__).parents[2] / "catalog"
"""Folder of the built-in scenarios."""
MOTION = "experiment.motion"
BUILT_IN = {
    "robot": (ROBOT, *sorted(path.parent.name for path in CATALOG.glob("robots/*/robot.toml"))),
    MOTION: tuple(sorted(path.stem for path in CATALOG.glob("motions/*.toml"))),
}
"""Keys whose value is the path of a file or one of these names."""


def seen_from(table: Mapping[str, object], beside: Path, folder: Path) -> dict[str, object]:
    """Return a scenario's tables with paths relative to another folder."""

    def seen(place: object, key: str) -> object:
        if beside == folder or not isinstance(place, str) or place in BUILT_IN[key] or Path(place).is_absolute():
            return place
        return os.path.relpath(beside / place, folder)

    def of_draw(draw: object) -> object:
        if not isinstance(draw, Mapping) or not isinstance(draw.get("choice"), list):
            return draw
        targets = draw.get("target")
        moving = MOTION in (targets if isinstance(targets, list) else [targets])
        return {**draw, "choice": [seen(each, MOTION) for each in draw["choice"]]} if moving else draw

    found = dict(table)
    if "robot" in found:
        found["robot"] = seen(found["robot"], "robot")
    experiment = found.get("experiment")
    if isinstance(experiment, Mapping) and "motion" in experiment:
        found["experiment"] = {**experiment, "motion": seen(experiment["motion"], MOTION)}
    for group in ("random", "sources"):
        draws = found.get(group)
        if isinstance(draws, Mapping):
            found[group] = {name: of_draw(draw) for name, draw in draws.items()}
    return found
