"""JSON Schema of what commands print with `--json`, a module for those of one kind.

Every object may have more keys than these; those that stand here are a contract.
"""

from pydantic import BaseModel

from scenarios.files.result_schemas.bare import BareResult
from scenarios.files.result_schemas.check import Check
from scenarios.files.result_schemas.design import NewRobot, PayloadDesign
from scenarios.files.result_schemas.gains import GainComparison, Patched, Torques
from scenarios.files.result_schemas.listing import ListedScenarios, Written
from scenarios.files.result_schemas.methods import Answers, Comparison, Contract, SealedProblems
from scenarios.files.result_schemas.motions import Converted, Sampled, Searched
from scenarios.files.result_schemas.run import Result
from scenarios.files.result_schemas.studies import Budget, PaperResult, PredictedBudget, StudyResult
from scenarios.files.result_schemas.weighing import CrossValidation, FoundPayload, Verification

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
