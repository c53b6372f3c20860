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
    stated = np.linalg.norm(solution.payload, axis=1)  # (k,)
    granted = np.linalg.norm(solution.model, axis=1)  # (k,)
    predicted = np.linalg.norm(
        (predicted, stated, granted), axis=0
    )  # the interval that a refusal judges is the whole one
    joints: dict[int, JointResult] = {
        j: RefusedGain(joint=problem.joint_name(j), reason=reason, predicted_rel_std=None)
        for j, reason in solution.unsolved.items()
    }
    for k, j in enumerate(solution.joints.tolist()):
        gain, expected = 1.0 / float(solution.inverse[k]), float(predicted[k])
        unit = "N m" if problem.structure.arm.revolute[j] else "N"
        reason = refusal(expected, float(solution.load_rms[k]), options.max_rel_std, unit)
        if reason is not None:
            joints[j] = RefusedGain(joint=problem.joint_name(j), reason=reason, predicted_rel_std=expected)
            continue
        joints[j] = IdentifiedGain(
            joint=problem.joint_name(j),
            value=gain,
            std=float(np.sqrt(covariance[k, k])) * gain**2,  # g = 1/x: std(g) = g^2 std(x)
            payload_rel_std=float(stated[k]),
            model_rel_std=float(granted[k]),
            predicted_rel_std=expected,
        )
    return GainEstimate(
        method=method,
        joints=tuple(joints[j] for j in sorted(joints)),
        solution=solution,
        covariance=covariance,
        options=options,
        payload=payload,
    )
