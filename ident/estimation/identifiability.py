"""From a solution to an estimate: covariance, predicted standard deviation, contribution of the payload, refusals."""

import numpy as np

from ident.estimation.estimate import (
    FoundParameter,
    GainEstimate,
    GainSolution,
    IdentifiedGain,
    JointResult,
    RefusedGain,
)
from ident.estimation.intervals import UNCERTAINTIES, Rows
from ident.estimation.problem import Problem
from ident.support.arrays import Array


def judge_identifiability(
    method: str, problem: Problem, solution: GainSolution, *, payload: tuple[FoundParameter, ...] = ()
) -> GainEstimate:
    """Judge a solution joint by joint.

    Args:
        method: Name of the method.
        problem: The problem that it solved.
        solution: Its solution.
        payload: Payload parameters that it estimated with the gains.
    """
    options, rows = problem.options, solution.rows
    covariance = UNCERTAINTIES[options.uncertainty](rows, solution.influence)
    predicted = predicted_rel_std(rows, solution.influence, solution.inverse, covariance, options.noise_floor)
    shares = (predicted, solution.payload_rel_std, solution.model_rel_std)
    predicted = np.linalg.norm(shares, axis=0)  # refusals use the total standard deviation
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
            gain = 1.0 / float(solution.inverse[k])
            joints[j] = IdentifiedGain(
                joint=name,
                value=gain,
                residual_std=float(np.sqrt(covariance[k, k])) * gain**2,  # g = 1/x: std(g) = g^2 std(x)
                payload_rel_std=float(shares[1][k]),
                model_rel_std=float(shares[2][k]),
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


def predicted_rel_std(rows: Rows, influence: Array, inverse: Array, covariance: Array, noise_floor: float) -> Array:
    """Predict the relative standard deviations of gains from such data.

    Args:
        rows: Rows that the gains were estimated from.
        influence: Derivative of each 1/g by each row's current, shape (k, r).
        inverse: 1/g, shape (k,).
        covariance: Covariance of 1/g from the residuals, shape (k, k).
        noise_floor: Residual that any real drive has, as a share of the joint's rms current.

    Returns:
        Shape (k,).
    """
    least = rows.least_std(influence, noise_floor)
    return np.maximum(np.sqrt(np.diag(covariance)), least) / np.abs(inverse)  # std(g) / g = std(1/g) / (1/g)


def refusal(predicted_rel_std: float, load_rms: float, max_rel_std: float, unit: str) -> str | None:
    """Return the reason if a gain is refused, else None.

    Args:
        predicted_rel_std: Predicted relative standard deviation.
        load_rms: Root mean square of the payload's torque or force on the joint.
        max_rel_std: Largest one that is accepted.
        unit: Unit of `load_rms`.
    """
    if predicted_rel_std <= max_rel_std:
        return None
    load = (
        f"the payload puts {load_rms:.3g} {unit} rms on this joint" if load_rms > 0.0 else "no payload loads this joint"
    )
    most = _percent(max_rel_std)
    return f"predicted standard deviation {_percent(predicted_rel_std)} of the gain exceeds {most}; {load}"


def ratio_refusal(rel_std: float, max_rel_std: float, reference: int) -> str | None:
    """Return the reason if the ratio of a gain to that of another joint is refused, else None.

    Args:
        rel_std: Relative standard deviation of the ratio, inf if the data do not relate the joints.
        max_rel_std: Largest one that is accepted.
        reference: The other joint, from 0.
    """
    if rel_std <= max_rel_std:
        return None
    tied = f"these motions hardly excite the links that it shares with joint {reference + 1}"
    return f"standard deviation {_percent(rel_std)} of the ratio exceeds {_percent(max_rel_std)}; {tied}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
