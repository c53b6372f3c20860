"""What an arm's own torque and its friction say of the currents of one log beside those of another.

Links and motors are the same in both logs, so that currents of the second may count s times those of the first:

    V_1 = [F_1  A_1  0  ] [phi_1; x; p]        A_k  (r_k, a)  own columns of the joint without friction and offset
    V_2 = [F_2  sA_2 P_2] [phi_2; x; p]        F_k  (r_k, 3)  friction and offset, anew in each log
                                               P_2  (r_2, .)  the payload's unknown columns and its known torque

The payload takes up a change of the gain; only the arm's own torque and, as a witness that may change itself, friction
show s. For each s the fit is linear, so that s alone is searched (`docs/derivations.md`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from ident.arrays import Array, Indices, readonly
from ident.base import independent_columns
from ident.column_space import NEW, column_space
from ident.gain_system import JointRows, joint_rows
from ident.problem import Problem
from ident.rows import Rows
from ident.uncertainty.cautious import cautious
from ident.uncertainty.larger import larger

SCALES = np.geomspace(1e-4, 1e4, 97)
"""Where s is looked for, either sign; neighbours are a fifth apart."""
STEP = 0.25
"""Logarithm around the best of those."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """How many times the currents of one joint in a first log those in a second one count.

    Attributes:
        joint: The joint, from 0.
        value: s.
        std: Its deviation, for errors that last.
        evidence: Logarithm of the likelihood ratio of white residuals, of s against 1.
        friction: The same s by friction at usual speed, None where there is none.
    """

    joint: int
    value: float
    std: float
    evidence: float
    friction: float | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Log:
    """What one log says of a joint's own columns, all in units of what its own fit leaves.

    Attributes:
        A: Own columns cleared of what each log has for itself, shape (r, a).
        v: Currents, cleared likewise, shape (r,).
        own: Orthonormal columns of what the log has for itself, shape (r, .).
        raw: The own columns as they are, shape (r, a).
        apart: What the log has for itself, friction first, shape (r, .).
        brakes: Number of friction columns.
        V: Currents as they are, shape (r,).
        position: Number of each row, shape (r,).
        sigma: What the log's own fit leaves [drive units].
    """

    A: Array
    v: Array
    own: Array
    raw: Array
    apart: Array
    brakes: int
    V: Array
    position: Indices
    sigma: float

    def friction(self, x: Array) -> float:
        """Friction at usual speed [drive units] beside own parameters x."""
        size = np.maximum(np.linalg.norm(self.apart, axis=0), 1e-300)
        found = np.linalg.lstsq(self.apart / size, self.V - self.raw @ x, rcond=1e-9)[0] / size
        return float(np.sum(found[: self.brakes])) * self.sigma

    @property
    def reduced(self) -> Array:
        """The triangle that sums of squares of `A x - v` need, shape (at most a + 1, a + 1)."""
        R = linalg.qr(np.column_stack((self.A, self.v)), mode="r", check_finite=False)[0]
        return readonly(R[: self.A.shape[1] + 1])


def own_scales(problem: Problem, first: int, second: int, *, bare: bool = False) -> list[Scale]:
    """What each joint that shows it says of the currents of two motions.

    Args:
        problem: Motions; what is not known of the payload of the second is free.
        first: Place of the first.
        second: Place of the second.
        bare: Whether both surely have a bare flange; if not, a motion without a payload may carry one nobody stated.
    """
    found = [own_scale(problem, joint, first, second, bare=bare) for joint in range(problem.structure.arm.n)]
    return [each for each in found if each is not None]


def own_scale(problem: Problem, joint: int, first: int, second: int, *, bare: bool = False) -> Scale | None:
    """What a joint, from 0, says; None where its own torque shows in none, or rows are too few."""
    rows = joint_rows(problem, joint)
    size = np.sqrt(np.sum(rows.W**2, axis=0))
    nothing = np.zeros((len(rows.V), 0))
    one = _log(rows, first, nothing, size)
    two = _log(rows, second, nothing if bare else _payload(problem, rows, second), size)
    if one is None or two is None:
        return None
    triangles = one.reduced, two.reduced
    grid = np.concatenate((SCALES, -SCALES))
    near = float(grid[int(np.argmin([_left(triangles, s) for s in grid]))])
    best = optimize.minimize_scalar(
        lambda change: _left(triangles, near * float(np.exp(change))), bounds=(-STEP, STEP), method="bounded"
    )
    s = near * float(np.exp(best.x))
    x = _solved(triangles, s)
    std = _std(problem, joint, one, two, s, x)
    if std is None:
        return None
    return Scale(
        joint=joint,
        value=s,
        std=std,
        evidence=0.5 * (_left(triangles, 1.0) - _left(triangles, s)),
        friction=_friction_ratio(one, two, s, x),
    )


def _log(rows: JointRows, motion: int, payload: Array, size: Array) -> _Log | None:
    """One motion's rows; None where its own unknowns leave nothing over."""
    kept = rows.motion == motion
    brakes = np.isin(rows.names, (f"Fv{rows.joint + 1}", f"Fc{rows.joint + 1}"))
    own = brakes | np.isin(rows.names, (f"off{rows.joint + 1}",))
    W, V = (rows.W / np.where(size > 0.0, size, 1.0))[kept], rows.V[kept]
    raw, apart = W[:, ~own], np.hstack((W[:, brakes], W[:, own & ~brakes], payload[kept]))
    basis = column_space(apart)
    A, v = raw - basis @ (basis.T @ raw), V - basis @ (basis.T @ V)
    together = column_space(A)
    freedom = len(v) - basis.shape[1] - together.shape[1]
    left = float(np.linalg.norm(v - together @ (together.T @ v)))
    if freedom < 1 or left == 0.0 or not together.shape[1]:
        return None
    sigma = left / float(np.sqrt(freedom))
    return _Log(
        A=A / sigma, v=v / sigma, own=basis, raw=raw / sigma, apart=apart, brakes=int(brakes.sum()), V=V / sigma,
        position=rows.position[kept], sigma=sigma,
    )  # fmt: skip


def _payload(problem: Problem, rows: JointRows, motion: int) -> Array:
    """Columns of the payload of a motion: each that is not known, and the torque of what is, (r, .)."""
    payload = problem.motions[motion].payload
    probes = problem.structure.payload_probes[rows.joint]
    part = problem.motions[motion].observation.joints[rows.joint].W_L
    W_L = np.zeros((len(rows.V), part.shape[1]))
    W_L[rows.motion == motion] = part
    if payload is None:
        return W_L[:, independent_columns(probes, [np.arange(probes.shape[1])])]
    known = payload.known_part()
    unknown = independent_columns(probes, [np.flatnonzero(~known.mask)])
    return np.column_stack((W_L[:, unknown], W_L[:, known.mask] @ known.chi[known.mask]))


def _stacked(triangles: Sequence[Array], s: float) -> tuple[Array, Array]:
    one, two = triangles
    return np.vstack((one[:, :-1], s * two[:, :-1])), np.concatenate((one[:, -1], two[:, -1]))


def _solved(triangles: Sequence[Array], s: float) -> Array:
    M, y = _stacked(triangles, s)
    return readonly(np.linalg.lstsq(M, y, rcond=1e-9)[0])


def _left(triangles: Sequence[Array], s: float) -> float:
    """Sum of squares that the best parameters leave under s."""
    M, y = _stacked(triangles, s)
    return float(np.sum((y - M @ _solved(triangles, s)) ** 2))


def _std(problem: Problem, joint: int, one: _Log, two: _Log, s: float, x: Array) -> float | None:
    """Deviation of s, linear around it."""
    W = np.vstack((one.A, s * two.A))
    together = column_space(W)
    along = np.concatenate((np.zeros(len(one.v)), two.A @ x))
    new = along - together @ (together.T @ along)
    size = float(np.linalg.norm(new))
    if size <= NEW * float(np.linalg.norm(along)):
        return None
    explained = np.hstack((linalg.block_diag(one.own, two.own), together, (new / size)[:, None]))
    V = np.concatenate((one.V, two.V))
    rows = Rows(
        V=V, residual=np.concatenate((one.v, two.v)) - W @ x, joint=np.full(len(V), joint),
        motion=np.repeat([0, 1], [len(one.v), len(two.v)]), position=np.concatenate((one.position, two.position)),
        row_period=problem.row_period, unknowns={joint: float(explained.shape[1])}, weight=np.ones(len(V)),
        explained=explained,
    )  # fmt: skip
    influence, serial_s = (new / size**2)[None], problem.options.serial_s
    return float(np.sqrt(max(each(rows, influence, serial_s)[0, 0] for each in (cautious, larger))))


def _friction_ratio(one: _Log, two: _Log, s: float, x: Array) -> float | None:
    """Friction at usual speed in the second log over that in the first."""
    if not one.brakes:
        return None
    first, second = one.friction(x), two.friction(s * x)
    return second / first if first != 0.0 else None
