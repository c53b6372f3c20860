"""JSON Schema of the files that users write and read, generated from what validates them; `make schemas` writes them.

A file of this repository names its schema by a relative path, `#:schema ../schemas/scenario.schema.json`; a file that a
command writes, by a full one (`scenarios.experiments.files.toml_text`).
"""

import json
from collections.abc import Generator
from dataclasses import is_dataclass
from inspect import cleandoc
from typing import Annotated, Any, Literal, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field

from scenarios.benchmark.comparison.contract import Contract
from scenarios.benchmark.comparison.seal import SealedProblems
from scenarios.benchmark.comparison.statistics import Comparison
from scenarios.benchmark.methods.answer import AnswerFile
from scenarios.benchmark.methods.answers import Answers
from scenarios.benchmark.paper.result import PaperResult
from scenarios.design.payload_design import PayloadDesign
from scenarios.design.results import NewRobot, Recorded, Searched
from scenarios.experiments.files.attribute_docs import attribute_docs
from scenarios.experiments.files.gains import GainsFile
from scenarios.experiments.files.motions import LARGEST, LONGEST
from scenarios.experiments.files.schema import InertiaTable, Known, Positive, ScenarioTable, Triple
from scenarios.experiments.files.toml_text import ENDING, FOLDER
from scenarios.experiments.studies.budget import Budget
from scenarios.experiments.studies.statistics import StudyResult
from scenarios.gains_in_use.results import GainComparison, Patched, Torques
from scenarios.gains_in_use.weighing import CrossValidation, FoundPayload, Verification
from scenarios.prediction.budget import PredictedBudget
from scenarios.results.bare import BareResult
from scenarios.results.check import Check
from scenarios.results.gains import Result
from scenarios.results.problem_folder import ProblemFile
from scenarios.results.written import Converted, ListedScenarios, Written
from sim.robot_files import RobotTable

RESULTS: dict[str, type[BaseModel]] = {
    "result": Result,
    "check": Check,
    "list": ListedScenarios,
    "written": Written,
    "convert": Converted,
    "record": Recorded,
    "excite": Searched,
    "new-robot": NewRobot,
    "payload-design": PayloadDesign,
    "identify-bare": BareResult,
    "verify": Verification,
    "verify-motions": CrossValidation,
    "verify-gains": GainComparison,
    "payload-of": FoundPayload,
    "torque": Torques,
    "patch": Patched,
    "predict": PredictedBudget,
    "monte-carlo": StudyResult,
    "sensitivity": Budget,
    "compare": Comparison,
    "compare-answers": Answers,
    "compare-check": Contract,
    "compare-seal": SealedProblems,
    "paper": PaperResult,
}
"""Models of results by the name of their schema."""
Coefficient = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


class PayloadFile(BaseModel):
    """A payload as specified, in the frame of the last link."""

    model_config = ConfigDict(extra="forbid")
    mass: Positive = Field(description="Mass [kg]")
    mass_std: float = Field(0.0, ge=0.0, description="Standard deviation of the mass [kg]")
    com: Triple | None = Field(None, description="Centre of mass [m]")
    com_std: Triple | None = Field(None, description="Standard deviation of the centre of mass, per axis [m]")
    inertia: InertiaTable | None = Field(
        None, description="Inertia about the centre of mass [kg m^2]; may be omitted if `known` is `mass`"
    )
    inertia_std: InertiaTable | None = Field(None, description="Standard deviations of the inertia [kg m^2]")
    known: Known = Field("all", description="What identification may use of the payload")


class MotionFile(BaseModel):
    """A motion as a Fourier series that starts and ends at rest, in radians; one entry or row per joint."""

    model_config = ConfigDict(extra="forbid")
    duration: float = Field(gt=0.0, le=LONGEST, description="Duration of one period [s]")
    center: list[Coefficient] = Field(description="Mean position [rad]")
    sine: list[list[Coefficient]] = Field(description="Coefficients of sin(2 pi k t / duration), k = 1, 2, ... [rad]")
    cosine: list[list[Coefficient]] = Field(description="Coefficients of cos(2 pi k t / duration) [rad]")


def schemas() -> dict[str, dict[str, Any]]:
    """The schemas by name."""
    scenario = _described(ScenarioTable)
    scenario["properties"]["extends"] = {"type": "string", "description": "Scenario that this one extends"}
    for table in (scenario, *scenario["$defs"].values()):
        if table.get("title") not in COMPLETE:
            table.pop("required", None)  # omitted keys are those of the extended scenario
    files: dict[str, type[BaseModel]] = {
        "payload": PayloadFile,
        "motion": MotionFile,
        "answer": AnswerFile,
        "gains": GainsFile,
        "problem": ProblemFile,
        "robot": RobotTable,
    }
    found = {"scenario": scenario} | {name: _described(file) for name, file in (files | RESULTS).items()}
    return {name: {"$schema": DIALECT, **schema} for name, schema in found.items()}


def _described(file: type[BaseModel]) -> dict[str, Any]:
    """Return the schema of a file, with descriptions of keys from the docstrings of their classes."""
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
    """Yield a class and the classes of its attributes, recursively."""
    for part in get_args(kind):
        yield from _classes(part)
    if isinstance(kind, type) and (issubclass(kind, BaseModel) or is_dataclass(kind)):
        yield kind
        for hint in get_type_hints(kind).values():
            yield from _classes(hint)


COMPLETE = ("DrawTable", "SourceTable")
"""Tables that an extending file must state in full."""
DIALECT: Literal["https://json-schema.org/draft/2020-12/schema"] = "https://json-schema.org/draft/2020-12/schema"


def write_schemas() -> None:
    """Write every schema into the package."""
    FOLDER.mkdir(exist_ok=True)
    for name, schema in schemas().items():
        (FOLDER / f"{name}{ENDING}").write_text(json.dumps(schema, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_schemas()
