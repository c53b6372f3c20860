"""JSON Schema of the files that users write and read, generated from what validates them; `make schemas` writes them.

A TOML file names its schema in its first line, relative to itself: `#:schema ../schemas/scenario.schema.json`. Taplo,
and editors that use it, complete and check keys by it.
"""

import json
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from scenarios.files.schema import Known, Positive, ScenarioTable, Triple
from scenarios.methods.answer import AnswerFile
from scenarios.store.problem_folder import ProblemFile

FOLDER = Path(__file__).parents[1] / "schemas"
"""Where the schemas lie, in the package."""
ENDING = ".schema.json"


class _Open(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow")


class SixNumbers(BaseModel):
    """Inertia about the centre of mass, axes of the last link [kg m^2]; products that are left out are 0."""

    model_config = ConfigDict(extra="forbid")
    ixx: float
    iyy: float
    izz: float
    ixy: float = 0.0
    ixz: float = 0.0
    iyz: float = 0.0


class PayloadFile(BaseModel):
    """A payload as weighed and drawn, in the frame of the last link."""

    model_config = ConfigDict(extra="forbid")
    mass: Positive = Field(description="[kg]")
    mass_std: float = Field(0.0, ge=0.0, description="standard deviation [kg]")
    com: Triple | None = Field(None, description="centre of mass [m]")
    com_std: Triple | None = Field(None, description="standard deviation, per axis [m]")
    inertia: SixNumbers | None = None
    inertia_std: SixNumbers | None = None
    known: Known = Field("all", description="what identification may use of it")


class ResultGain(_Open):
    """One joint's gain; what needs a truth is null where there is none."""

    joint: int = Field(ge=1)
    true: float | None
    estimate: float | None = Field(description="[N m / drive unit], null if refused")
    std: float | None
    rel_error: float | None
    z: float | None
    tolerance: float | None
    identifiable: bool
    passed: bool | None
    reason: str | None


class ResultFit(_Open):
    """How well the data are explained."""

    method: str
    rows: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class ResultTiming(_Open):
    """Wall times [s]."""

    simulate_s: float | None
    identify_s: float


class Result(_Open):
    """What `rx90 run --json` and `rx90 identify --json` print."""

    scenario: str | None
    seed: int | None
    passed: bool | None
    gains: list[ResultGain]
    payload: list[dict[str, Any]]
    fit: ResultFit
    timing: ResultTiming


def schemas() -> dict[str, dict[str, Any]]:
    """The schemas by name."""
    scenario = ScenarioTable.model_json_schema()
    scenario["properties"]["extends"] = {"type": "string", "description": "a scenario that this one overlays"}
    for table in (scenario, *scenario["$defs"].values()):
        if table.get("title") not in COMPLETE:
            table.pop("required", None)  # what is left out is what the extended scenario has
    others = {"payload": PayloadFile, "result": Result, "answer": AnswerFile, "problem": ProblemFile}
    found = {"scenario": scenario, **{name: kind.model_json_schema() for name, kind in others.items()}}
    return {name: {"$schema": DIALECT, **schema} for name, schema in found.items()}


COMPLETE = ("DrawTable", "SourceTable")
"""Tables that no overlay completes."""
DIALECT: Literal["https://json-schema.org/draft/2020-12/schema"] = "https://json-schema.org/draft/2020-12/schema"


def write_schemas() -> None:
    """Write every schema into the package."""
    FOLDER.mkdir(exist_ok=True)
    for name, schema in schemas().items():
        (FOLDER / f"{name}{ENDING}").write_text(json.dumps(schema, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_schemas()
