"""Checks by fits of each joint alone: the sign of its friction, and the accuracy of its gain with a planned payload.

If friction drives instead of braking, positions or currents have the wrong sign. Each joint is solved alone with its
own base parameters, friction and offset in drive units. The gain has the sign of the friction; a negative one is not
necessarily a mistake, but the user should know in advance.

For a planned payload, the rows of the log represent both motions, without and with it. The standard deviation of 1/g
follows from the columns (paper, eq. 20) and the residual: that of a joint's own fit, but at least that of real drives.
An approximate gain, from a data sheet or the robot file, converts it to a relative one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, finding
from ident.estimation.estimate import FRICTION_Z, largest
from ident.estimation.intervals import Basis, Rows, max_of_classical_and_jackknife
from ident.estimation.joint_by_joint import gain_system
from ident.estimation.problem import GainOptions, ObservedMotion, Problem, pair
from ident.estimation.rows import joint_rows
from ident.numerics.least_squares import least_squares
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.arrays import Array, readonly
from ident.support.errors import NotIdentifiable

RANK_TOL = 1e-9
"""Smallest singular value of unit columns, relative to the largest."""


def friction_z(problem: Problem, joint: int) -> Array:
    """Return total and Coulomb friction of a joint over their standard deviations, shape (2,); 0 with too few rows."""
    rows = joint_rows(problem, joint)
    size = np.linalg.norm(rows.W, axis=0)
    U, s, Vt = np.linalg.svd(rows.W / np.where(size > 0.0, size, 1.0), full_matrices=False)
    rank = int(np.sum(s > RANK_TOL * s.max(initial=0.0)))
    if len(rows.V) <= rank:
        return np.zeros(2)
    Q, kinds = U[:, :rank], np.array((rows.of_parameter("Fv", "Fc"), rows.of_parameter("Fc")), dtype=np.float64)
    influence = readonly(kinds @ (Vt[:rank].T / s[:rank]) @ Q.T)  # at typical speed; dependent columns share equally
    fitted = Rows(
        V=rows.V, residual=rows.V - Q @ (Q.T @ rows.V), joint=rows.joint, motion=rows.motion,
        position=rows.position, unknowns={joint: float(rank)}, weight=np.ones(len(rows.V)), explained=Basis.of(Q),
    )  # fmt: skip
    std = np.sqrt(np.diag(max_of_classical_and_jackknife(fitted, influence)))
    return np.divide(influence @ rows.V, std, out=np.zeros(2), where=std > 0.0)


def friction_sign(problems: Sequence[Problem], about: Array | None) -> list[Diagnosis]:
    """Return the diagnosis of joints that friction drives and never brakes, for gains `about`, (n,), or positive."""
    n, found = problems[0].structure.arm.n, list[Diagnosis]()
    for j, sign in enumerate(np.ones(n) if about is None else np.sign(about)):
        z = [sign * float(largest(friction_z(problem, j))) for problem in problems]
        if min(z) < -FRICTION_Z and max(z) < FRICTION_Z:
            sentence = f"friction of joint {j + 1} has the sign of a driving torque: v{j + 1} and q{j + 1} have "
            advice = f"negate q{j + 1} or v{j + 1}, whichever contradicts the model; otherwise the gain is negative"
            found.append(finding(None, "friction sign", sentence + "opposite signs", advice, joints=(j,)))
    good = "friction opposes the motion of every joint where it is identifiable"
    return found or [finding(None, "friction sign", good)]


def opposed(problem: Problem) -> list[tuple[int, int]]:
    """Joints, from 0, that friction significantly brakes in one log and drives in another, with the faulty log.

    It is the one with the less frequent sign, of two the later one. An unknown payload of negative mass could explain
    a negated current of a vertical prismatic joint; friction cannot be explained so.
    """
    motions = [replace(problem, motions=(each,)) for each in problem.motions]
    found = list[tuple[int, int]]()
    for joint in range(problem.structure.arm.n):
        z = np.array([largest(friction_z(each, joint)) for each in motions])
        if z.max() > FRICTION_Z and z.min() < -FRICTION_Z:
            brakes, drives = np.flatnonzero(z > FRICTION_Z), np.flatnonzero(z < -FRICTION_Z)
            found.append((joint, int(min(brakes, drives, key=lambda logs: (len(logs), -logs[-1]))[-1])))
    return found


def predicted_rel_std(
    observation: Observation, payload: Payload, gain: Array, options: GainOptions
) -> tuple[float | None, ...]:
    """Predict the relative standard deviation of gains (n,) [N m / unit] with a payload; None if not identifiable."""
    both = pair(observation, observation, payload, options)
    alone = Problem(observation.structure, (ObservedMotion(observation, None),), options)

    def predicted(joint: int) -> float | None:
        system, rows = gain_system(both, joint, [payload.known_part()]), joint_rows(alone, joint)
        if system is None:
            return None
        try:
            own, fit = (
                least_squares(W, V, rank_tol=RANK_TOL) for W, V in ((rows.W, rows.V), (system.W, system.rows.V))
            )
        except NotIdentifiable:
            return None
        sigma = max(own.sigma, options.noise_floor * float(np.sqrt(np.mean(rows.V**2))))
        return sigma * float(np.sqrt(fit.cofactor[-1, -1])) * abs(float(gain[joint]))  # std(g) / g = g std(1/g)

    return tuple(predicted(joint) for joint in range(observation.structure.arm.n))


def excitation(log: str, predicted: tuple[float | None, ...], options: GainOptions) -> Diagnosis:
    """Return the diagnosis of the gains that motion and payload would identify."""
    unseen = [j for j, std in enumerate(predicted) if std is None or std > options.max_rel_std]
    words = ", ".join("-" if std is None else f"{100.0 * std:.2g}" for std in predicted)
    listed = ", ".join(str(j + 1) for j in unseen)
    advice = f"for joint {listed}, mount the payload farther from its axis, or a heavier one" if unseen else None
    sentence = f"predicted standard deviations of the gains, joint by joint: {words} %"
    return finding(log, "excitation", sentence, advice, joints=unseen)
