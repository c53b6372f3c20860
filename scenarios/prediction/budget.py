"""The predicted error budget of a scenario: error of each gain from each source, and from all together."""

from collections.abc import Iterable
from statistics import NormalDist

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnose import horizon
from ident.diagnosis.diagnosis import Diagnosed, Exclusion
from ident.estimation.estimate import RefusedGain
from ident.support.errors import IdentificationError
from scenarios.experiments.scenario import setup_of
from scenarios.experiments.schema import Scenario
from scenarios.prediction.moments import Moments
from scenarios.prediction.predictor import NO_SPECTRUM, predictor_of
from scenarios.rendering.content import Cell, Column, Mood, Paragraph, Part, Table, cells, percent
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.results.diagnoses import diagnosed_values, horizon_paragraphs
from scenarios.results.gains import budget_verdict
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError
from sim.feedforward_currents import check_torque_limits

OTHER = "noise that is no source"
MEANING = (
    "First-order rms relative error from each source alone, at its declared size. All together: sums of "
    "biases (signed) and of variances. Within: share of runs within tolerance, for normal errors."
)
CONTROL = "Assumes perfect control, independent sources and additive effects; nothing was simulated."
LEAST = 5e-6
"""Relative error of a source below which it is reported as 0."""


class Cost(ResultModel):
    """Relative error of a gain from one source."""

    source: str = Field(description="Name of the source or scenario")
    bias: float = Field(description="Mean of the relative error of the gain")
    std: float = Field(description="Standard deviation of the relative error of the gain")
    rms: float = Field(description="Root mean square of the relative error of the gain")

    @classmethod
    def of(cls, source: str, moments: Moments, k: int) -> "Cost":
        """Return the error of the k-th joint."""
        bias, std, rms = (float(each[k]) for each in (moments.bias, moments.std, moments.rms))
        return cls(source=source, bias=bias, std=std, rms=rms)


class PredictedBudgetJoint(ResultModel):
    """Budget of one joint."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    costs: list[Cost] = Field(description="One entry per source, sorted by the largest rms on any joint")
    together: Cost = Field(description="All sources together: sums of the signed biases and of the variances")
    tolerance: float = Field(description="Largest relative error that passes")
    within: float = Field(description="Probability that the error is within the tolerance")


class PredictedBudget(ResultModel):
    """What `rx90 predict --json` prints."""

    scenario: str = Field(description="Name of the source or scenario")
    method: str = Field(description="Name of the estimator")
    remarks: list[str] = Field(description="Assumptions of the model")
    joints: list[PredictedBudgetJoint] = Field(description="Joints whose gain the scenario requires and that have one")
    refused: list[dict[str, int | str]] = Field(
        description="Joints whose gain the scenario requires and that have none, with the reason"
    )
    unpredicted: list[dict[str, str]] = Field(description="Sources without a prediction, with the reason")
    excluded: list[FromOne[Exclusion]] = Field(description="Faults that logs of these motions will exclude")
    untold: list[str] = Field(description="Faults that logs of these motions cannot reveal")

    @property
    def title(self) -> str:
        """One line."""
        sources = len(self.joints[0].costs) if self.joints else 0
        return f"Predicted error budget of scenario {self.scenario}, method {self.method}: {sources} sources"

    def parts(self) -> Iterable[Part]:
        """Return verdict, all sources together with tolerances, error from each source, remarks."""
        worst = [max(each.costs, key=lambda cost: cost.rms).source for each in self.joints]
        yield budget_verdict(
            [(each.joint, each.together.rms, each.tolerance, of) for each, of in zip(self.joints, worst, strict=True)]
        )
        costs = list(zip(*(each.costs for each in self.joints), strict=True))  # of a source, by joint
        shown = [of_joints for of_joints in costs if any(each.rms >= LEAST for each in of_joints)]
        rows = [
            ("all together", *(percent(each.together.rms, ".3f") for each in self.joints)),
            ("  of which bias", *(percent(each.together.bias, "+.3f") for each in self.joints)),
            ("tolerance", *(percent(each.tolerance, ".3g") for each in self.joints)),
            ("within", *(_within(each.within) for each in self.joints)),
            *((of_joints[0].source, *(percent(each.rms, ".3f") for each in of_joints)) for of_joints in shown),
        ]
        names = (Column(title=f"Joint {each.joint}", unit="%") for each in self.joints)
        columns = (Column(title="Source", words=True), *names)
        yield Table(columns=columns, rows=tuple(cells(*row) for row in rows))
        none = [of_joints[0].source for of_joints in costs if of_joints not in shown]
        if none:
            yield Paragraph(f"Below {100.0 * LEAST:g} % on every joint: {', '.join(none)}.")
        yield Paragraph(MEANING)
        yield Paragraph(CONTROL)
        if self.remarks:
            yield Paragraph(f"Assumed without an error source: {'; '.join(self.remarks)}.")
        for each in self.refused:
            yield Paragraph(f"Joint {each['joint']}: no gain: {each['reason']}.", Mood.DOUBTFUL)
        for each in self.unpredicted:
            yield Paragraph(f"Not predicted: {each['source']}: {each['reason']}.", Mood.DOUBTFUL)
        found = Diagnosed(diagnoses=(), excluded=tuple(self.excluded), indistinguishable=tuple(self.untold))
        yield from horizon_paragraphs(found, every=True, expected=True)


def _within(share: float) -> Cell:
    return Cell(percent(share, ".0f"), Mood.GOOD if share > 0.95 else Mood.BAD if share < 0.5 else Mood.DOUBTFUL)


def predicted_budget(scenario: Scenario) -> PredictedBudget:
    """Predict the error budget of a scenario, and the faults that logs of its motions will exclude.

    Raises:
        TrajectoryError: If a drive cannot follow the motion; otherwise as `predictor_of`.
    """
    check_torque_limits(setup_of(scenario).experiments)
    predictor = predictor_of(scenario)
    estimate, costs, unpredicted = predictor.linear.estimate, dict[str, Moments](), list[dict[str, str]]()
    for name, source in scenario.table.sources.items():
        try:
            costs[name] = predictor.noise(source.stream) if source.stream else predictor.drawn(source)
        except (ScenarioError, SimulationError, IdentificationError) as error:
            unpredicted.append({"source": name, "reason": str(error)})
    if (other := predictor.other_noise) is not None:
        costs[OTHER] = other
    unpredicted += [{"source": OTHER, "reason": f"{NO_SPECTRUM} {stream}"} for stream in predictor.unknown]
    costs = dict(sorted(costs.items(), key=lambda item: -float(np.max(item[1].rms, initial=0.0))))
    tolerance, joints = scenario.table.tolerance, predictor.joints.tolist()
    together = Moments.together(costs.values(), len(joints))

    def joint(k: int, j: int) -> PredictedBudgetJoint:
        """Return the budget of the k-th joint, j from 0."""
        bias, std, most = float(together.bias[k]), max(float(together.std[k]), 1e-300), tolerance.gain[j]
        return PredictedBudgetJoint(
            joint=j + 1,
            costs=[Cost.of(name, cost, k) for name, cost in costs.items()],
            together=Cost.of("all together", together, k),
            tolerance=most,
            within=NormalDist().cdf((most - bias) / std) - NormalDist().cdf((-most - bias) / std),
        )

    said = diagnosed_values(horizon(predictor.linear.expected.logs()))
    missing = [j for j in np.flatnonzero(tolerance.identifiable).tolist() if j not in joints]
    refused = [(j, gain.reason) for j in missing if isinstance(gain := estimate.joints[j], RefusedGain)]
    return PredictedBudget(
        scenario=scenario.name,
        method=estimate.method,
        remarks=list(estimate.remarks),
        joints=[joint(k, j) for k, j in enumerate(joints)],
        refused=[{"joint": j + 1, "reason": reason} for j, reason in refused],
        unpredicted=unpredicted,
        excluded=said["excluded"],
        untold=said["untold"],
    )
