"""JSON Schema of the files that users write and of results, generated from the models that validate them.

`rx90 schema NAME` prints one. Those of TOML files are also in the package (`make schemas` writes them): a file of this
repository names its schema by a relative path, `#:schema ../schemas/scenario.schema.json`, one that a command writes by
a full one (`scenarios.support.texts`).
"""

import json
import re
from collections.abc import Generator
from dataclasses import is_dataclass
from importlib import import_module
from inspect import cleandoc, getsource
from typing import Any, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field

from scenarios.experiments.schema import Known, Positive, Triple
from scenarios.support.texts import ENDING, FOLDER, attribute_docs
from sim.tables import InertiaTable

FILES = {
    "scenario": "scenarios.experiments.schema:ScenarioTable",
    "payload": "scenarios.results.json_schemas:PayloadFile",
    "motion": "scenarios.experiments.motions:MotionFile",
    "robot": "sim.robot:Robot",
    "gains": "scenarios.results.gains_file:GainsFile",
}
"""Models of TOML files, whose schemas are in the package, for editors that complete and check keys."""
RESULTS = {
    "answer": "scenarios.benchmark.methods:AnswerFile",
    "problem": "scenarios.results.problem_folder:ProblemFile",
    "result": "scenarios.results.gains:Result",
    "check": "scenarios.results.check:Check",
    "list": "scenarios.results.written:ListedScenarios",
    "convert": "scenarios.results.written:Converted",
    "record": "scenarios.design.record:Recorded",
    "excite": "scenarios.design.search:Searched",
    "new-robot": "scenarios.design.robot_folder:NewRobotResult",
    "payload-design": "scenarios.design.payload_design:PayloadDesign",
    "identify-bare": "scenarios.results.bare:BareResult",
    "verify": "scenarios.gains_in_use.weighing:Verification",
    "verify-gains": "scenarios.gains_in_use.gain_comparison:GainComparison",
    "payload-of": "scenarios.gains_in_use.weighing:FoundPayload",
    "torque": "scenarios.gains_in_use.known_gains:Torques",
    "patch": "scenarios.gains_in_use.patch:Patched",
    "predict": "scenarios.prediction.budget:PredictedBudget",
    "monte-carlo": "scenarios.results.studies:StudyResult",
    "sensitivity": "scenarios.results.sensitivity:Budget",
    "compare": "scenarios.benchmark.comparison:Comparison",
    "paper": "scenarios.benchmark.paper:PaperResult",
}
"""Models of JSON files and results by the name of their schema, which is generated when asked for."""


class PayloadFile(BaseModel):
    """A payload as specified, in the frame of the last link."""

    model_config = ConfigDict(extra="forbid")
    mass: Positive  # mass [kg]
    mass_std: float = Field(0.0, ge=0.0)  # standard deviation of the mass [kg]
    com: Triple | None = None  # centre of mass [m]
    com_std: Triple | None = None  # standard deviation of the centre of mass, per axis [m]
    inertia: InertiaTable | None = None  # inertia about the centre of mass [kg m^2]; unnecessary if `known` is `mass`
    inertia_std: InertiaTable | None = None  # standard deviations of the inertia [kg m^2]
    known: Known = "all"  # what identification may use of the payload


COMPLETE = ("DrawTable", "SourceTable")
"""Tables that an extending file must state in full."""
SECTION = re.compile("\n\n(?:Attributes|Raises):\n")
COMMENT = re.compile(r"^    (\w+): [^#\n]*  # (.+)$", re.MULTILINE)
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema(name: str) -> dict[str, Any]:
    """Return the schema of a key of `FILES` or `RESULTS`, with descriptions of keys from the docstrings of classes."""
    module, _, kind = (FILES | RESULTS)[name].partition(":")
    model: type[BaseModel] = getattr(import_module(module), kind)
    found = model.model_json_schema()
    classes = {each.__name__: each for each in _classes(model)}
    for title, table in [(found["title"], found), *found.get("$defs", {}).items()]:
        if title in classes:
            docs = {k: v for each in reversed(classes[title].__mro__) for k, v in _field_docs(each).items()}
            table["description"] = SECTION.split(cleandoc(classes[title].__doc__ or ""))[0]
            for key, value in table.get("properties", {}).items():
                if key in docs:  # joints count from 1 in JSON (`scenarios.rendering.result.FromOne`)
                    value.setdefault("description", docs[key].replace("from 0", "from 1").replace("None", "null"))
    if name == "scenario":
        found["properties"]["extends"] = {"type": "string", "description": "Scenario that this one extends"}
        for table in (found, *found["$defs"].values()):
            if table.get("title") not in COMPLETE:
                table.pop("required", None)  # omitted keys are those of the extended scenario
    return {"$schema": DIALECT, **found}


def _field_docs(kind: type) -> dict[str, str]:
    """Return descriptions of fields: of the docstring, or beside them."""
    beside = COMMENT.findall(getsource(kind)) if is_dataclass(kind) or issubclass(kind, BaseModel) else []
    return {name: text[0].upper() + text[1:] for name, text in beside} | attribute_docs(kind)


def _classes(kind: object) -> Generator[type]:
    """Yield a class and the classes of its attributes, recursively."""
    for part in get_args(kind):
        yield from _classes(part)
    if isinstance(kind, type) and (issubclass(kind, BaseModel) or is_dataclass(kind)):
        yield kind
        for hint in get_type_hints(kind).values():
            yield from _classes(hint)


def write_schemas() -> None:
    """Write the schemas of `FILES` into the package."""
    FOLDER.mkdir(exist_ok=True)
    for name in FILES:
        (FOLDER / f"{name}{ENDING}").write_text(json.dumps(schema(name), indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_schemas()
