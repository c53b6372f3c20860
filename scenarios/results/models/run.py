"""The result of a run or an identification."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic import Field

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.estimate import FoundParameter, GainEstimate
from ident.identification import Identification
from ident.model.parameters import INERTIAL
from ident.payload.payload import standard_parameters
from ident.payload_identification.gains_outcome import GainsOutcome
from ident.unseen import Unseen
from scenarios.results.models.cost import ResultCost
from scenarios.results.models.diagnoses import DiagnosedResult, diagnosed_values
from scenarios.results.models.gains import ResultGain, ResultParameter
from scenarios.results.models.unseen import ResultUnseen
from scenarios.support.result_model import ResultModel

if TYPE_CHECKING:  # the simulator is not needed by a process that only identifies
    from scenarios.experiments.run import Run


class ResultFit(ResultModel):
    """Quality of the fit."""

    method: str = Field(description="Name of the estimator")
    rows: int = Field(description="Number of rows of the linear systems of all joints")
    error_norm: float = Field(description="Norm of the residuals of all joints [drive units]")
    rel_error_norm: float = Field(description="Ratio of this norm to the norm of the currents")
    sigma: float = Field(description="Standard deviation of the residuals of all joints [drive units]")

    @classmethod
    def of(cls, estimate: GainEstimate) -> "ResultFit":
        """Return the quality of the fit of an estimate."""
        return cls.model_validate(estimate, from_attributes=True)


class ResultTiming(ResultModel):
    """Wall times [s]."""

    simulate_s: float | None = Field(description="Time of the simulation of all motions [s]")
    identify_s: float = Field(description="Time of the identification [s]")


class Result(DiagnosedResult):
    """What `rx90 run --json` and `rx90 identify --json` print."""

    scenario: str | None = Field(description="Name of the scenario")
    seed: int | None = Field(description="Seed of every random number")
    passed: bool | None = Field(description="The verdict")
    gains: list[ResultGain] = Field(description="One entry per joint, in order")
    payload: list[ResultParameter] = Field(description="Parameters of the payload, if the method estimates them")
    fit: ResultFit = Field(description="Quality of the fit")
    timing: ResultTiming = Field(description="Wall times")
    notes: list[str] = Field(default_factory=list[str], description="What the method selected, and remarks")
    cost: ResultCost | None = Field(
        None, description="Results with a-priori and with identified gains, null if not requested"
    )
    unseen: ResultUnseen | None = Field(
        None, description="Prediction of a motion that was not used in any fit, null if none is given"
    )

    @classmethod
    def of_run(cls, run: "Run") -> "Result":
        """Return the result of a run, with true values."""
        bodies = list(run.setup.true_payloads.values())
        true = {}  # with several payloads, a name is ambiguous
        if len(bodies) == 1:
            values = standard_parameters(bodies[0].mass, bodies[0].com, bodies[0].inertia).tolist()
            true = dict(zip(map(str, INERTIAL), values, strict=True))
        judged = enumerate(zip(run.estimate.joints, run.verdict.gains, strict=True), 1)
        return cls(
            scenario=run.setup.scenario.name,
            seed=run.seed,
            passed=run.passed,
            gains=[ResultGain.of(number, *each) for number, each in judged],
            payload=_payload(run.estimate.payload, true),
            timing=ResultTiming(simulate_s=run.simulate_s, identify_s=run.identify_s),
            cost=None if run.cost is None else ResultCost.of_verdict(run.cost, run.estimate.joints),
            **_common(run.estimate, run.notes, run.found),
        )

    @classmethod
    def of_identification(
        cls,
        found: Identification,
        identify_s: float,
        a_priori: GainsOutcome | None = None,
        unseen: Unseen | None = None,
    ) -> "Result":
        """Return the result of an identification, without true values. `identify_s` is a wall time [s]."""
        return cls(
            scenario=None,
            seed=None,
            passed=None,
            gains=[ResultGain.of(number, each) for number, each in enumerate(found.estimate.joints, 1)],
            payload=_payload(found.estimate.payload, {}),
            timing=ResultTiming(simulate_s=None, identify_s=identify_s),
            cost=None if a_priori is None else ResultCost.of_outcome(a_priori, found.estimate.joints),
            unseen=None if unseen is None else ResultUnseen.of(unseen),
            **_common(found.estimate, found.notes, found.found),
        )

    @property
    def judged(self) -> bool:
        """Whether true gains are known."""
        return all(gain.true is not None for gain in self.gains)


def _payload(found: tuple[FoundParameter, ...], true: Mapping[str, float]) -> list[ResultParameter]:
    return [ResultParameter.of(each, true.get(each.name)) for each in found]


def _common(estimate: GainEstimate, notes: tuple[str, ...], found: Diagnosed) -> dict[str, Any]:
    """Return the common values of both."""
    return {
        "fit": ResultFit.of(estimate),
        "notes": list(notes),
        **diagnosed_values(found),
    }
