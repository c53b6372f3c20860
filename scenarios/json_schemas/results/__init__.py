"""JSON Schema of what commands print with `--json`, a module for those of one kind.

Every object may have more keys than these; those that stand here are a contract.
"""

from pydantic import BaseModel

from scenarios.json_schemas.results.design import NewRobot, PayloadDesign
from scenarios.json_schemas.results.gains import GainComparison, Patched, Torques
from scenarios.json_schemas.results.listing import ListedScenarios, Written
from scenarios.json_schemas.results.methods import Answers, Comparison, Contract, SealedProblems
from scenarios.json_schemas.results.motions import Converted, Sampled, Searched
from scenarios.json_schemas.results.studies import Budget, PaperResult, PredictedBudget, StudyResult
from scenarios.json_schemas.results.weighing import CrossValidation, FoundPayload, Verification
from scenarios.results.models.bare import BareResult
from scenarios.results.models.check import Check
from scenarios.results.models.run import Result

RESULTS: dict[str, type[BaseModel]] = {
    "result": Result,
    "check": Check,
    "list": ListedScenarios,
    "written": Written,
    "convert": Converted,
    "trajectory": Sampled,
    "excite": Searched,
    "new-robot": NewRobot,
    "payload-design": PayloadDesign,
    "identify-bare": BareResult,
    "verify": Verification,
    "verify-motions": CrossValidation,
    "payload-of": FoundPayload,
    "torque": Torques,
    "patch": Patched,
    "compare-gains": GainComparison,
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
