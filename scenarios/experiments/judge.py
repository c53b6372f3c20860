"""`judge`: compare an estimate with the true values. The only module that uses both.

With a table `cost` it also compares the effect of the controller's gains: an additional payload, the arm and its torque
are estimated with the assumed and with the identified gains. The arm is identified from the bare motions. Its torque,
with the payload, is predicted on the first loaded motion, from which the gains were identified.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains
from ident.estimation.known_gains import estimated_gains, stated_gains
from ident.estimation.problem import Columns, ObservedMotion
from ident.identification import Identification
from ident.observation.observation import observe
from ident.parameters.arm import PLAIN, predicted_torque, rel_errors
from ident.parameters.payload import UNITS
from ident.parameters.weighing import GainsOutcome, gains_outcome, with_unknown_weight
from ident.payload.payload import Payload
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.experiments.robots import nominal_links
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import ToleranceTable
from scenarios.experiments.verdict import ArmError, Claim, GainVerdict


@dataclass(frozen=True, slots=True)
class Verdict:
    """Every joint's verdict; `passed` if all passed."""

    gains: tuple[GainVerdict, ...]

    @property
    def passed(self) -> bool:
        """Whether every joint passed."""
        return all(gain.passed for gain in self.gains)


def judge(estimate: GainEstimate, true_gain: Array, tolerance: ToleranceTable) -> Verdict:
    """Compare identified gains with injected ones [N m / drive unit], shape (n,)."""
    claims = list(map(Claim, estimate.gain.tolist(), estimate.std.tolist(), estimate.reasons))
    return judge_claims(claims, true_gain, tolerance)


def judge_claims(claims: Sequence[Claim], true_gain: Array, tolerance: ToleranceTable) -> Verdict:
    """Judge the answers of any method, one per joint."""
    gains: list[GainVerdict] = []
    rows = zip(claims, true_gain.tolist(), tolerance.gain, tolerance.identifiable, strict=True)
    for joint, (claim, true, allowed, expected) in enumerate(rows, 1):
        error = None if claim.value is None else claim.value - true
        within = error is not None and abs(error / true) <= allowed
        reason = claim.reason
        if error is not None:
            reason = None if within else f"off by {100 * error / true:+.3g} %, tolerance {100 * allowed:.3g} %"
            if not expected:
                reason = "identified, but tolerance.identifiable expects a refusal"
        gains.append(
            GainVerdict(
                joint=joint,
                true=true,
                estimate=claim.value,
                std=None if error is None else claim.std,
                rel_error=None if error is None else error / true,
                z=None if error is None or not claim.std else error / claim.std,
                tolerance=allowed,
                identifiable=error is not None,
                passed=within if expected else error is None,
                reason=reason,
            )
        )
    return Verdict(tuple(gains))


MOMENTS, INERTIAS = "first moments of the arm", "inertias of the arm"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CostVerdict:
    """Results with assumed and with identified gains (`found`, None if there are none), and the true values."""

    assumed: GainsOutcome
    found: GainsOutcome | None
    true: Mapping[str, float]  # mass, centre and inertia of the payload by name, in `UNITS`
    arm: tuple[ArmError, ...]
    # Error of the torque predicted on another motion relative to the true one, norms, by joint from 0 that has a gain:
    torque_assumed: Mapping[int, float]
    torque_found: Mapping[int, float]
    tolerance: float  # largest relative error of the mass that passes, with the identified gains

    @property
    def passed(self) -> bool:
        """Whether the mass is within tolerance with the identified gains."""
        mass = None if self.found is None else self.found.weighed.together.mass
        return mass is not None and abs(mass / self.true["mass"] - 1.0) <= self.tolerance


def cost_verdict(setup: Setup, found: Identification, check: Recording) -> CostVerdict:
    """Estimate payload and arm with the controller's gains and with the identified gains, and judge both."""
    table, plant, base = setup.scenario.table, setup.plant, setup.structure.base
    assert table.cost is not None, "requested where the scenario has it"
    assert setup.check is not None, "requested where the scenario has it"
    assert found.prepared is not None, "a run has what it was identified from"
    problem, weight = found.prepared.problem, setup.check.plant.payload
    exact = Payload(mass=weight.mass, com=weight.com, inertia=weight.inertia)
    motion = ObservedMotion(observe(check, setup.structure, found.observing), exact)
    weighing, own = with_unknown_weight(problem, [motion]), table.identification.method_options
    options = own if isinstance(own, AllJointsOptions) else PLAIN
    estimate = all_joints_gains(replace(weighing, motions=(*weighing.motions[:-1], motion)), options)
    gains = stated_gains(setup.structure.arm, table.belief.controller_gain), estimated_gains(found.estimate)
    assumed, identified = (
        gains_outcome(weighing, exact, each, options, estimate) if len(each.joints) else None for each in gains
    )
    assert assumed is not None, "the controller has a gain for every joint"
    links = nominal_links(plant.robot.model, plant.robot.flange).whole
    true_base = base.regrouping @ base.standard(links, {"Ia": plant.drives.rotor_inertia})
    other = next(each for each in problem.motions if each.payload is not None)
    return CostVerdict(
        assumed=assumed,
        found=identified,
        true=dict(zip(UNITS, (weight.mass, *weight.com, *weight.inertia), strict=True)),
        arm=arm_errors(assumed, identified, dict(zip(base.names, true_base.tolist(), strict=True))),
        torque_assumed=_torque_errors(assumed, setup.true_gain, other),
        torque_found={} if identified is None else _torque_errors(identified, setup.true_gain, other),
        tolerance=table.cost.mass_error,
    )


def arm_errors(assumed: GainsOutcome, found: GainsOutcome | None, true: Mapping[str, float]) -> tuple[ArmError, ...]:
    """Return the errors of the arm's first moments and other inertias; `true` has its base parameters by name."""

    def errors(name: str, outcome: GainsOutcome | None, moments: bool) -> dict[str, float | None]:
        if outcome is None:
            return {name: None, f"{name}_std": None}
        own = [each for each in outcome.arm.inertial if each.name.startswith("M") == moments]
        size = np.linalg.norm([true[each.name] for each in own])
        off = np.linalg.norm([(each.value - true[each.name], each.std) for each in own], axis=0) / size
        return {name: float(off[0]), f"{name}_std": float(off[1])}

    rows = (
        {"quantity": kind, **errors("assumed", assumed, moments), **errors("found", found, moments)}
        for kind, moments in ((MOMENTS, True), (INERTIAS, False))
    )
    return tuple(map(ArmError.model_validate, rows))


def _torque_errors(outcome: GainsOutcome, true_gain: Array, other: ObservedMotion) -> dict[int, float]:
    """Return the error of the torque predicted on another motion, with a payload, by joints that have a gain."""
    assert other.payload is not None, "of a loaded motion"
    system = Columns.of([other])
    true = true_gain[system.joint] * system.V
    errors = rel_errors(predicted_torque(system, outcome.arm.in_si()[0], other.payload) - true, true, system.joint)
    return {j: errors[j] for j in outcome.gains.joints.tolist()}
