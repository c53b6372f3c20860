"""Recipes of public recordings: TOML files with their source, format and published gains."""

import json
from collections.abc import Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, JsonValue, ValidationError

from ident.recordings.formats.description import LogDescription
from ident.recordings.formats.description_files import description_of
from ident.support.naming import one_line
from ident.support.toml_files import read_toml
from scenarios.experiments.files.places import CATALOG
from scenarios.support.errors import ScenarioError

RECIPES = CATALOG / "recordings"


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class SetTable(_Table):
    """Recordings of one identification; paths are relative to the user's folder.

    Attributes:
        name: Name of the set.
        bare: Recordings with a bare flange.
        loaded: Recordings with the payload.
        payload: Payload file; omitted without a payload.
    """

    name: str
    bare: tuple[str, ...] = Field(min_length=1)
    loaded: tuple[str, ...] = ()
    payload: str | None = None


class SensorTable(_Table):
    """Columns of one file with torques of sensors and motors; `{j}` is replaced by the joint's number.

    Attributes:
        file: Parquet file with the columns.
        joints: Number of joints.
        motor: Torque or current of the motor.
        sensors: Torque sensors behind the gear.
        velocity: Speed of the joint.
    """

    file: str
    joints: int = Field(ge=1)
    motor: str
    sensors: tuple[str, ...] = Field(min_length=1)
    velocity: str


class Recipe(_Table):
    """Public recordings of one robot.

    Attributes:
        name: Name of robot and recordings.
        source: Publication.
        licence: Licence as stated by the source.
        get: How to download the recordings and convert them to the files of this recipe.
        untried: Whether this project has not read any of these files.
        model: Model file of the arm, in the user's folder or in that of the catalogue.
        couplings: Pairs of joints, from 1, whose second motor turns with the sum of both.
        log: Format of the recordings, as in a log description.
        set: Sets of recordings that are identified together.
        published: Published gains, one per joint, in N m per logged unit.
        published_by: Source and basis of the published gains.
        sensors: Columns of joint torque sensors.
    """

    name: str
    source: str
    licence: str
    get: str
    untried: bool = False
    model: str | None = None
    couplings: tuple[tuple[int, int], ...] = ()
    log: dict[str, JsonValue] = {}
    set: tuple[SetTable, ...] = ()
    published: tuple[float, ...] | None = None
    published_by: str | None = None
    sensors: SensorTable | None = None

    @property
    def files(self) -> tuple[str, ...]:
        """Return all files of the recipe, without repetition."""
        of_sets = [name for each in self.set for name in (*each.bare, *each.loaded, each.payload)]
        others = [self.model, self.sensors and self.sensors.file]
        return tuple(dict.fromkeys(name for name in (*others, *of_sets) if name is not None))

    def place(self, name: str, folder: Path) -> Path:
        """Return the path of a file: in a folder, or for a missing model in that of the recipes."""
        own = folder / name
        return RECIPES / name if name == self.model and not own.exists() else own

    @property
    def description(self) -> LogDescription:
        """Return the log description of the recordings."""
        return description_of(self.log, f"recipe {self.name}: log")


def read_recipe(path: Path) -> Recipe:
    """Read a recipe.

    Raises:
        ScenarioError: If it is missing, not TOML or not valid; one line.
    """
    table = read_toml(path, error=ScenarioError)
    try:
        found = Recipe.model_validate_json(json.dumps(table, default=str), strict=True)
        _ = found.description
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ScenarioError(f"{one_line(path)}: key {place} of the recipe: {one_line(first['msg'])}") from error
    if found.set and found.model is None:
        raise ScenarioError(f"{one_line(path)}: model is missing; it is needed for identification")
    for each in found.set:
        if bool(each.loaded) != (each.payload is not None):
            raise ScenarioError(f"{one_line(path)}: set {each.name}: loaded and payload go together; give both or none")
    return found


def recipes(more: Sequence[Path] = ()) -> tuple[Recipe, ...]:
    """Return the recipes of the catalogue by the names of their files, and further ones.

    Raises:
        ScenarioError: If one cannot be read, or two have the same name.
    """
    found = tuple(map(read_recipe, (*sorted(RECIPES.glob("*.toml")), *more)))
    names = [each.name for each in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ScenarioError(f"two recipes are called {twice!r}; rename one")
    return found
