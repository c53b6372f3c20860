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
from ident.estimation.estimate import FRICTION_Z
from ident.estimation.intervals import Rows, max_of_classical_and_jackknife
from ident.estimation.joint_by_joint import gain_system
from ident.estimation.problem import GainOptions, ObservedMotion, Problem, pair
from ident.estimation.rows import Columns, joint_rows
from ident.numerics.least_squares import least_squares
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.support.arrays import Array, readonly
from ident.support.errors import NotIdentifiable

RANK_TOL = 1e-9
"""Smallest singular value of unit columns, relative to the largest."""


def friction_z(problem: Problem, joint: int) -> float | None:
    """Return friction of a joint over its standard deviation, total or Coulomb; None with too few rows.

    The more significant of the two is returned.

    Args:
        problem: One motion, with any payload.
        joint: The joint, from 0.
    """
    rows = joint_rows(problem, joint)
    Q, friction = _total_and_coulomb(rows.W, rows)
    rank = Q.shape[1]
    if len(rows.V) <= rank:
        return None
    influence = readonly(friction @ Q.T)
    fitted = Rows(
        V=rows.V, residual=rows.V - Q @ (Q.T @ rows.V), joint=rows.joint, motion=rows.motion,
        position=rows.position, row_period=problem.row_period, unknowns={joint: float(rank)},
        weight=np.ones(len(rows.V)), explained=Q,
    )  # fmt: skip
    std = np.sqrt(np.diag(max_of_classical_and_jackknife(fitted, influence)))
    z = np.divide(influence @ rows.V, std, out=np.zeros(2), where=std > 0.0)
    return float(z[np.argmax(np.abs(z))])


def white_friction_z(problem: Problem, joint: int) -> Array | None:
    """Total and Coulomb friction over their standard deviations for white residuals, shape (2,), or None.

    These are the smallest deviations, and from the triangular factor of the rows alone.
    """
    rows = joint_rows(problem, joint)
    R = np.asarray(np.linalg.qr(np.column_stack((rows.W, rows.V)), mode="r"))
    W, V = np.split(R, [-1], axis=1)
    U, friction = _total_and_coulomb(W, rows)
    if len(rows.V) <= U.shape[1]:
        return None
    inside = (U.T @ V)[:, 0]
    sigma = np.linalg.norm(V[:, 0] - U @ inside) / np.sqrt(len(rows.V) - U.shape[1])
    std = sigma * np.linalg.norm(friction, axis=1)
    return np.divide(friction @ inside, std, out=np.zeros(2), where=std > 0.0)


def _total_and_coulomb(W: Array, rows: Columns) -> tuple[Array, Array]:
    """Orthonormal basis of columns (r, p), and friction at typical speed by the coordinates in it, (r, k) and (2, k).

    It is of minimum norm: dependent columns share equally.
    """
    size = np.linalg.norm(W, axis=0)
    U, s, Vt = np.linalg.svd(W / np.where(size > 0.0, size, 1.0), full_matrices=False)
    rank = int(np.sum(s > RANK_TOL * s.max(initial=0.0)))
    both, dry = rows.of_parameter("Fv", "Fc"), rows.of_parameter("Fc")
    return U[:, :rank], np.array((both, dry), dtype=np.float64) @ (Vt[:rank].T / s[:rank])


def backward_joints(problems: Sequence[Problem], about: Array | None) -> tuple[int, ...]:
    """Joints, from 0, whose friction significantly drives in some log and brakes in none.

    Args:
        problems: One motion each, of one arm.
        about: Gains with the expected signs, shape (n,); positive if None.
    """
    found: list[int] = []
    expected = np.ones(problems[0].structure.arm.n) if about is None else np.sign(about)
    for joint in range(problems[0].structure.arm.n):
        seen = [friction_z(problem, joint) for problem in problems]
        z = [float(expected[joint]) * each for each in seen if each is not None]
        if z and min(z) < -FRICTION_Z and max(z) < FRICTION_Z:
            found.append(joint)
    return tuple(found)


def friction_sign(problems: Sequence[Problem], about: Array | None) -> list[Diagnosis]:
    """Return the diagnosis of joints that friction drives; arguments as `backward_joints`."""
    good = "friction opposes the motion of every joint where it is identifiable"
    return [
        finding(
            None, "friction sign",
            f"friction of joint {j + 1} has the sign of a driving torque: v{j + 1} and q{j + 1} have opposite signs",
            f"negate q{j + 1} or v{j + 1}, whichever contradicts the model; otherwise the gain is negative",
            joints=(j,),
        )
        for j in backward_joints(problems, about)
    ] or [finding(None, "friction sign", good)]  # fmt: skip


def opposed(problem: Problem) -> list[tuple[int, int]]:
    """Joints, from 0, that friction significantly brakes in one log and drives in another, with the faulty log.

    A negated current of a vertical prismatic joint in one log can be explained by an unknown payload of negative mass;
    friction reveals it. The faulty log is the one with the less frequent sign, of two the later one.
    """
    motions = [replace(problem, motions=(each,)) for each in problem.motions]
    found: list[tuple[int, int]] = []
    for joint in range(problem.structure.arm.n):
        white = [z for each in motions if (z := white_friction_z(each, joint)) is not None]
        if not white or np.max(white) <= FRICTION_Z or np.min(white) >= -FRICTION_Z:
            continue
        z = np.array([friction_z(each, joint) or 0.0 for each in motions])
        if z.max() > FRICTION_Z and z.min() < -FRICTION_Z:
            brakes, drives = np.flatnonzero(z > FRICTION_Z), np.flatnonzero(z < -FRICTION_Z)
            found.append((joint, int(min(brakes, drives, key=lambda logs: (len(logs), -logs[-1]))[-1])))
    return found


def predicted_rel_std(
    observation: Observation, payload: Payload, gain: Array, options: GainOptions
) -> tuple[float | None, ...]:
    """Predict the relative standard deviation of each gain, joint by joint; None if it is not identifiable.

    Args:
        observation: A motion with a bare flange.
        payload: The payload to be mounted.
        gain: Approximate gains [N m / drive unit], shape (n,).
        options: When a gain counts as identifiable.
    """
    both = pair(observation, observation, payload, options)
    alone = Problem(observation.structure, (ObservedMotion(observation, None),), options)
    return tuple(
        _predicted(both, alone, joint, float(gain[joint]), options) for joint in range(observation.structure.arm.n)
    )


def _predicted(both: Problem, alone: Problem, joint: int, gain: float, options: GainOptions) -> float | None:
    system = gain_system(both, joint, [payload.known_part() for payload in both.payloads])
    if system is None:
        return None
    rows = joint_rows(alone, joint)
    try:
        own = least_squares(rows.W, rows.V, rank_tol=RANK_TOL)
        fit = least_squares(system.W, system.rows.V, rank_tol=RANK_TOL)
    except NotIdentifiable:
        return None
    sigma = max(own.sigma, options.noise_floor * float(np.sqrt(np.mean(rows.V**2))))
    return sigma * float(np.sqrt(fit.cofactor[-1, -1])) * abs(gain)  # std(g) / g = g std(1/g)


def excitation(log: str, predicted: tuple[float | None, ...], options: GainOptions) -> Diagnosis:
    """Return the diagnosis of the gains that motion and payload would identify."""
    unseen = [j for j, std in enumerate(predicted) if std is None or std > options.max_rel_std]
    words = ", ".join("-" if std is None else f"{100.0 * std:.2g}" for std in predicted)
    listed = ", ".join(str(j + 1) for j in unseen)
    advice = f"for joint {listed}, mount the payload farther from its axis, or a heavier one" if unseen else None
    sentence = f"predicted standard deviations of the gains, joint by joint: {words} %"
    return finding(log, "excitation", sentence, advice, joints=unseen)
