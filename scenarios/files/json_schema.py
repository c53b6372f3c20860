"""JSON Schema of the files that users write and read, generated from what validates them; `make schemas` writes them.

A file of this repository names its schema relative to itself, `#:schema ../schemas/scenario.schema.json`, one that a
command writes in full (`scenarios.files.schema_line`).
"""

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from scenarios.files.gains import GainsFile
from scenarios.files.motions import LARGEST, LONGEST
from scenarios.files.result_schemas import RESULTS
from scenarios.files.schema import InertiaTable, Known, Positive, ScenarioTable, Triple
from scenarios.files.schema_line import ENDING, FOLDER
from scenarios.methods.answer import AnswerFile
from scenarios.store.problem_folder import ProblemFile
from sim.robot_files import RobotTable

Coefficient = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


class _Open(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow")


class PayloadFile(BaseModel):
    """A payload as weighed and drawn, in the frame of the last link."""

    model_config = ConfigDict(extra="forbid")
    mass: Positive = Field(description="[kg]")
    mass_std: float = Field(0.0, ge=0.0, description="standard deviation [kg]")
    com: Triple | None = Field(None, description="centre of mass [m]")
    com_std: Triple | None = Field(None, description="standard deviation, per axis [m]")
    inertia: InertiaTable | None = None
    inertia_std: InertiaTable | None = None
    known: Known = Field("all", description="what identification may use of it")


class MotionFile(BaseModel):
    """A motion as a Fourier series that starts and ends at rest, in radians; one entry or row a joint."""

    model_config = ConfigDict(extra="forbid")
    duration: float = Field(gt=0.0, le=LONGEST, description="of one period [s]")
    center: list[Coefficient] = Field(description="mean position [rad]")
    sine: list[list[Coefficient]] = Field(description="coefficients of sin(2 pi k t / duration), k = 1, 2, ... [rad]")
    cosine: list[list[Coefficient]] = Field(description="coefficients of cos(2 pi k t / duration) [rad]")


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


class ResultFinding(_Open):
    """What a consistency test of the estimate found."""

    check: str = Field(description="its name")
    joint: int = Field(ge=1, description="the joint that fails most, or would first")
    statistic: float
    threshold: float = Field(description="above it the statistic is no accident, or too much")
    measure: str = Field(description="what both are")
    failed: bool
    sentence: str | None = Field(description="what it means, null where it passes or does not matter")


class Result(_Open):
    """What `rx90 run --json` and `rx90 identify --json` print."""

    scenario: str | None
    seed: int | None
    passed: bool | None
    gains: list[ResultGain]
    payload: list[dict[str, Any]]
    fit: ResultFit
    timing: ResultTiming
    consistency: list[ResultFinding] = Field(default_factory=list[ResultFinding])


class CheckLine(_Open):
    """A line of a check; `log` and `joint` are null where it is about all of them."""

    log: str | None
    what: str
    joint: int | None = Field(ge=1)
    verdict: Literal["good", "weak", "wrong"]
    seen: str
    advice: str | None


class CheckJoint(_Open):
    """How a joint moved in a log."""

    joint: int = Field(ge=1)
    low: float = Field(description="[rad or m]")
    high: float
    covered: float | None = Field(description="share of the joint's range, null where no limits are stated")
    speed: float = Field(ge=0.0, description="largest [rad/s or m/s]")
    speed_rms: float = Field(ge=0.0)
    acceleration_rms: float = Field(ge=0.0)
    slow: float = Field(ge=0.0, le=1.0, description="share of the time beside reversals")
    current_rms: float = Field(ge=0.0, description="[drive units]")


class CheckLog(_Open):
    """A log; without joints if it cannot be filtered."""

    log: str
    joints: list[CheckJoint]


class CheckReadings(_Open):
    """Other readings of all logs together."""

    better: list[str] = Field(description="that surely explain the currents better than the logs as they are")
    same: list[str] = Field(description="that no motion tells from the logs as they are")
    out_of_reach: list[int] = Field(description="joints that the logs put where they cannot be")
    driven_by_friction: list[int] = Field(description="joints whose positions or currents count backwards")


class Check(_Open):
    """What `rx90 check --json` prints."""

    robot: str
    verdict: Literal["good", "weak", "wrong"]
    lines: list[CheckLine]
    logs: list[CheckLog]
    readings: CheckReadings


def schemas() -> dict[str, dict[str, Any]]:
    """The schemas by name."""
    scenario = ScenarioTable.model_json_schema()
    scenario["properties"]["extends"] = {"type": "string", "description": "a scenario that this one overlays"}
    for table in (scenario, *scenario["$defs"].values()):
        if table.get("title") not in COMPLETE:
            table.pop("required", None)  # what is left out is what the extended scenario has
    files: dict[str, type[BaseModel]] = {
        "payload": PayloadFile,
        "motion": MotionFile,
        "result": Result,
        "check": Check,
        "answer": AnswerFile,
        "gains": GainsFile,
        "problem": ProblemFile,
        "robot": RobotTable,
    }
    found = {"scenario": scenario} | {name: file.model_json_schema() for name, file in (files | RESULTS).items()}
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
