"""JSON Schema of what commands print with `--json`, a module for those of one kind.

Every object may have more keys than these; those that stand here are a contract.
"""

from pydantic import BaseModel

from scenarios.benchmark.comparison.contract import Contract
from scenarios.benchmark.comparison.seal import SealedProblems
from scenarios.benchmark.comparison.statistics import Comparison
from scenarios.benchmark.methods.answers import Answers
from scenarios.benchmark.paper.result import PaperResult
from scenarios.design.results import NewRobot, PayloadDesign, Sampled, Searched
from scenarios.experiments.files.listed import ListedScenarios
from scenarios.experiments.studies.budget import Budget
from scenarios.experiments.studies.statistics import StudyResult
from scenarios.gains_in_use.results import GainComparison, Patched, Torques
from scenarios.gains_in_use.weighing import CrossValidation, FoundPayload, Verification
from scenarios.prediction.result import PredictedBudget
from scenarios.results.models.bare import BareResult
from scenarios.results.models.check import Check
from scenarios.results.models.run import Result
from scenarios.results.written import Converted, Written

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
