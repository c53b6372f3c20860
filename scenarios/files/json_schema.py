"""JSON Schema of the files that users write and read, generated from what validates them; `make schemas` writes them.

A file of this repository names its schema relative to itself, `#:schema ../schemas/scenario.schema.json`, one that a
command writes in full (`scenarios.files.schema_line`).
"""

import json
from collections.abc import Generator
from dataclasses import is_dataclass
from inspect import cleandoc
from typing import Annotated, Any, Literal, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field

from scenarios.files.attribute_docs import attribute_docs
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
    """A payload as weighed and drawn, in the frame of the last link.

    Attributes:
        inertia: About the centre of mass [kg m^2]; may be left out where `known` is `mass`.
        inertia_std: Standard deviations [kg m^2].
    """

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
    """One joint's gain; what needs a truth is null where there is none.

    Attributes:
        joint: Its number, from 1.
        true: Injected gain [N m / drive unit].
        std: Standard deviation of the estimate, all shares together [N m / drive unit].
        rel_error: Relative error of the estimate.
        z: Error over `std`.
        tolerance: Relative error that passes.
        identifiable: Whether there is an estimate.
        passed: Whether the joint is as its scenario wants it.
        reason: Why the joint is refused.
        name: Of the joint in the robot's model.
        residual_std: Share of the residuals [N m / drive unit].
        payload_std: Share of what is stated of the payload [N m / drive unit].
        model_std: Share of what the model takes for granted [N m / drive unit].
        total_std: The same as `std` [N m / drive unit].
        predicted_rel_std: Relative standard deviation that the payload lets one expect.
    """

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
    name: str | None = None
    residual_std: float | None = None
    payload_std: float | None = None
    model_std: float | None = None
    total_std: float | None = None
    predicted_rel_std: float | None = None


class ResultFit(_Open):
    """How well the data are explained.

    Attributes:
        method: Name of the estimator.
        rows: Of the linear systems of all joints.
        error_norm: Norm of the residuals of all joints [drive units].
        rel_error_norm: The same over the norm of the currents.
        sigma: Standard deviation of the residuals of all joints [drive units].
    """

    method: str
    rows: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class ResultTiming(_Open):
    """Wall times [s].

    Attributes:
        simulate_s: For all motions [s].
        identify_s: For the estimate [s].
    """

    simulate_s: float | None
    identify_s: float


class ResultFinding(_Open):
    """What a consistency test of the estimate found.

    Attributes:
        statistic: What was found.
        failed: Whether it is above the threshold.
    """

    check: str = Field(description="its name")
    joint: int = Field(ge=1, description="the joint that fails most, or would first")
    statistic: float
    threshold: float = Field(description="above it the statistic is no accident, or too much")
    measure: str = Field(description="what both are")
    failed: bool
    sentence: str | None = Field(description="what it means, null where it passes or does not matter")


class Result(_Open):
    """What `rx90 run --json` and `rx90 identify --json` print.

    Attributes:
        scenario: Its name.
        seed: Of every random number.
        passed: The verdict.
        gains: One a joint, in their order.
        payload: The payload's parameters, where they are found too.
        fit: How well the data are explained.
        timing: Wall times.
        notes: What the method chose and what one should know.
        consistency: Tests of the estimate against itself.
    """

    scenario: str | None
    seed: int | None
    passed: bool | None
    gains: list[ResultGain]
    payload: list[dict[str, Any]]
    fit: ResultFit
    timing: ResultTiming
    notes: list[str] = Field(default_factory=list[str])
    consistency: list[ResultFinding] = Field(default_factory=list[ResultFinding])


class CheckLine(_Open):
    """A line of a check; `log` and `joint` are null where it is about all of them.

    Attributes:
        log: Name of the log.
        what: What was looked at.
        joint: Its number, from 1.
        verdict: On this line.
        seen: What was found, in words.
        advice: What to do.
    """

    log: str | None
    what: str
    joint: int | None = Field(ge=1)
    verdict: Literal["good", "weak", "wrong"]
    seen: str
    advice: str | None


class CheckJoint(_Open):
    """How a joint moved in a log.

    Attributes:
        joint: Its number, from 1.
        high: Largest position [rad or m].
        speed_rms: Rms of the speed [rad/s or m/s].
        acceleration_rms: Rms of the acceleration [rad/s^2 or m/s^2].
    """

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
    """A log; without joints if it cannot be filtered.

    Attributes:
        log: Its name.
        joints: One entry a joint.
    """

    log: str
    joints: list[CheckJoint]


class CheckReadings(_Open):
    """Other readings of all logs together."""

    better: list[str] = Field(description="that surely explain the currents better than the logs as they are")
    same: list[str] = Field(description="that no motion tells from the logs as they are")
    out_of_reach: list[int] = Field(description="joints that the logs put where they cannot be")
    driven_by_friction: list[int] = Field(description="joints whose positions or currents count backwards")


class Check(_Open):
    """What `rx90 check --json` prints.

    Attributes:
        robot: Its name.
        verdict: The worst of all lines.
        lines: What was looked at.
        logs: How joints moved.
        readings: Other readings of all logs together.
    """

    robot: str
    verdict: Literal["good", "weak", "wrong"]
    lines: list[CheckLine]
    logs: list[CheckLog]
    readings: CheckReadings


def schemas() -> dict[str, dict[str, Any]]:
    """The schemas by name."""
    scenario = _described(ScenarioTable)
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
    found = {"scenario": scenario} | {name: _described(file) for name, file in (files | RESULTS).items()}
    return {name: {"$schema": DIALECT, **schema} for name, schema in found.items()}


def _described(file: type[BaseModel]) -> dict[str, Any]:
    """The schema of a file, each key with what the docstring of its class, or of one it inherits from, says of it."""
    schema = file.model_json_schema()
    kinds = {kind.__name__: kind for kind in _classes(file)}
    for title, table in [(schema["title"], schema), *schema.get("$defs", {}).items()]:
        if title in kinds:
            docs = {k: v for kind in reversed(kinds[title].__mro__) for k, v in attribute_docs(kind).items()}
            table["description"] = cleandoc(kinds[title].__doc__ or "").partition("\n\nAttributes:\n")[0]
            for key, value in table["properties"].items():
                if key in docs:
                    value.setdefault("description", docs[key])
    return schema


def _classes(kind: object) -> Generator[type]:
    """A class, and all that its attributes are of, however nested."""
    for part in get_args(kind):
        yield from _classes(part)
    if isinstance(kind, type) and (issubclass(kind, BaseModel) or is_dataclass(kind)):
        yield kind
        for hint in get_type_hints(kind).values():
            yield from _classes(hint)


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
