"""From a solution to an estimate: covariance, predicted deviation, the payload's share, refusals."""

import numpy as np

from ident.estimation.estimate import (
    FoundParameter,
    GainEstimate,
    GainSolution,
    IdentifiedGain,
    JointResult,
    RefusedGain,
)
from ident.estimation.prediction import predicted_rel_std
from ident.estimation.problem import Problem
from ident.estimation.refusal import refusal
from ident.estimation.uncertainty import UNCERTAINTIES


def judge_identifiability(
    method: str, problem: Problem, solution: GainSolution, *, payload: tuple[FoundParameter, ...] = ()
) -> GainEstimate:
    """Judge a solution joint by joint.

    Args:
        method: Name of the method.
        problem: What it was given.
        solution: What it found.
        payload: Payload parameters that it found on its way.
    """
    options, rows = problem.options, solution.rows
    covariance = UNCERTAINTIES[options.uncertainty](rows, solution.influence, options.serial_s)
    predicted = predicted_rel_std(rows, solution.influence, solution.inverse, covariance, options.noise_floor)
    shares = (predicted, solution.payload_rel_std, solution.model_rel_std)
    predicted = np.linalg.norm(shares, axis=0)  # the interval that a refusal judges is the whole one
    joints: dict[int, JointResult] = {
        j: RefusedGain(joint=problem.joint_name(j), reason=reason, predicted_rel_std=None)
        for j, reason in solution.unsolved.items()
    }
    for k, j in enumerate(solution.joints.tolist()):
        name, expected = problem.joint_name(j), float(predicted[k])
        unit = "N m" if problem.structure.arm.revolute[j] else "N"
        reason = refusal(expected, float(solution.load_rms[k]), options.max_rel_std, unit)
        if reason is not None:
            joints[j] = RefusedGain(joint=name, reason=reason, predicted_rel_std=expected)
        else:
            joints[j] = IdentifiedGain.of(solution, k, joint=name, covariance=covariance, predicted_rel_std=expected)
    return GainEstimate(
        method=method,
        joints=tuple(joints[j] for j in sorted(joints)),
        solution=solution,
        covariance=covariance,
        options=options,
        payload=payload,
    )
