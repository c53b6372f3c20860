"""All joints at once: common link parameters, friction of each joint, logarithmic gains.

    V_j = h_j (A_j theta + k_j) + F_j phi_j + e_j        h_j = 1 / g_j

A_j, theta   columns and values of the shared parameters: the arm's base parameters without friction and offset, the
             unknown parameters of each mounting, and appended ones such as errors of zeros and compliances [SI]
k_j          torque of the known payload parameters [N m]
F_j, phi_j   columns of the joint's own friction and offset, and their values in drive units

Rows are weighted by 1 / sigma_j. phi, then theta are eliminated (variable projection), which leaves log|h|: with
T_j = h_j (A_j theta + k_j), r the residual and Q an orthonormal basis of the columns of theta, a step solves

    [T'(T - r) - (T - r)' Q Q' (T - r) + 1 / prior_std^2] ds = T' r - (s - mean) / prior_std^2        s = log|h|

with r omitted on the left where that is not positive definite (Gauss and Newton). All sums are over cross products by
joint and time block (`ident.estimation.blocks`), whose coordinates z, c stand for theta, phi.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import lapack

from ident.estimation.blocks import flat, flipped
from ident.estimation.estimate import GainSolution
from ident.estimation.intervals import FREE_BLOCK, Basis, Part, Rows, deviations, larger_of, of_changes, rms
from ident.estimation.problem import OWN
from ident.estimation.setting import Model, Setting, Term
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

GIVEN_STD = 1e-9
"""Prior standard deviation of the logarithm of a given gain: negligible."""
CONVERGED = 1e-8
"""Largest norm of the last step."""
LONGEST_STEP = 0.5
"""Largest norm of the change of the logarithms in one step."""
MOST_STEPS = 200
POOR, GOOD = 0.25, 0.75
"""Ratios of actual to predicted decrease below which damping increases, and above which it decreases."""
SLOWER, FASTER = 4.0, 1.0 / 6.0
UNDAMPED, DAMPED = 1e-9, 1e-3
"""Initial and smallest damping, so that a free scale is not singular; damping after the first failed step."""
SAME_COST = 1e-13
"""Relative increase of the cost that is rounding error."""
FAR = 3.0
"""Largest difference between joints in the change of log|h| up to which columns count as orthonormal: the condition
number of the cross products is then at most e^6, a loss of three of sixteen digits."""


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """The model at h: coordinates z, factor of their cross products, Z'T, Z'r, T'T, T'V of each joint, and the cost."""

    h: Array
    z: Array
    L: Array
    ZT: Array
    Zr: Array
    TT: Array
    TV: Array
    cost: float


def search(model: Model, start: Array, mean: Array, std: Array) -> tuple[Model, _Point]:
    """Minimise the sum of squares over all joints by h, with a prior of log|h|, shapes (n,); raises `NotIdentifiable`.

    The model has other coordinates if the gains end far from the initial ones.
    """

    def far(h: Array) -> bool:
        return bool(np.ptp(np.log(np.abs(h / model.sigma / model.blocks.weight))) > FAR)

    if far(start):
        model = replace(model, blocks=model.blocks.at(start / model.sigma))
    S, prior = model.eliminated[2], model.blocks.prior
    Z, k, V = S[:, :-2, :-2], S[:, :-2, -2], S[:, :-2, -1]
    flat, believed = Z.reshape(len(Z), -1), prior.T @ prior

    def point(s: Array) -> _Point:
        h = np.sign(start) * np.exp(s)
        L = lapack.dpotrf((h**2 @ flat).reshape(believed.shape) + believed, lower=1)[0]
        z = lapack.dpotrs(L, h @ V - h**2 @ k, lower=1)[0]
        torque = Z @ z + k
        TT = h**2 * (torque @ z + k @ z + S[:, -2, -2])
        TV = h * (V @ z + S[:, -2, -1])
        squares = S[:, -1, -1] - 2.0 * TV + TT
        off = (s - mean) / std
        ZT = h[:, None] * torque
        return _Point(h, z, L, ZT, V - ZT, TT, TV, float(squares.sum() + z @ believed @ z + off @ off))

    def curvature(at: _Point, Zr: Array, Tr: Array) -> Array:
        along = lapack.dtrtrs(at.L, (at.h[:, None] * (at.ZT - Zr)).T, lower=1)[0]
        return np.diag(at.TT - Tr + std**-2.0) - along.T @ along

    s: Array = np.log(np.abs(start))
    damping, at = UNDAMPED, point(s)
    for _ in range(MOST_STEPS):
        gradient = at.TV - at.TT - (s - mean) / std**2
        H = curvature(at, at.Zr, at.TV - at.TT)
        size = np.sqrt(np.maximum(np.diag(H), 0.0))
        if not size.all() or np.linalg.eigvalsh(H / np.outer(size, size))[0] <= 0.0:
            H = curvature(at, np.zeros_like(at.Zr), np.zeros_like(at.TT))
        while True:
            step = np.linalg.solve(H + damping * np.diag(np.diag(H)), gradient)
            length = float(np.linalg.norm(step))
            step *= min(1.0, LONGEST_STEP / max(length, 1e-300))
            tried = point(s + step)
            if length < CONVERGED:
                return model, tried
            if tried.cost <= at.cost * (1.0 + SAME_COST):
                break
            damping = max(8.0 * damping, DAMPED)
        kept = (at.cost - tried.cost) / max(float(gradient @ step), 1e-300)  # ratio of actual to predicted decrease
        damping = max(UNDAMPED, damping * (SLOWER if kept < POOR else FASTER if kept > GOOD else 1.0))
        s, at = s + step, tried
        if far(at.h):
            return search(model, at.h, mean, std)
    raise NotIdentifiable(f"the gains do not converge in {MOST_STEPS} steps; record longer, or with a heavier payload")


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A fitted model, linearised at the result: sensitivities of its unknowns s = log|h|, theta and phi.

    The unknowns are u = (s, z), shape (n + k,), and c of each joint, shape (n, f). `J` is the derivative of a joint's
    currents by u through [Z k].
    """

    ready: Setting  # the problem
    model: Model  # the model
    h: Array  # 1/g with its sign, shape (n,)
    z: Array  # coordinates of the shared parameters, shape (k,)
    mean: Array  # prior mean of log|h|, shape (n,)
    log_std: Array  # its prior standard deviation, shape (n,)
    cost: float  # sum of squares of weighted residuals and priors

    @cached_property
    def theta(self) -> Array:
        """Shared parameters, zero if not identifiable, shape (p,)."""
        return self.model.blocks.U @ self.z

    @cached_property
    def rest(self) -> Array:
        """Coefficients of [Z k V] in the residual, shape (n, k + 2)."""
        h = self.h[:, None]
        return np.concatenate((-h * self.z, -h, np.ones_like(h)), axis=1)

    @cached_property
    def c(self) -> Array:
        """Coefficients of the orthonormal own columns, shape (n, f)."""
        return (self.model.eliminated[1] @ self.rest[..., None])[..., 0]

    @cached_property
    def _to_phi(self) -> Array:
        """Derivative of phi by the coefficients of [Z k V] in the residual, beside that through c, (n, f, k + 2)."""
        blocks, f = self.model.blocks, len(self.model.names)
        C = np.concatenate((blocks.C[:, :, :-2] @ blocks.U, blocks.C[:, :, -2:]), axis=2)
        return self.model.inverse @ np.pad(C, ((0, 0), (0, f - C.shape[1]), (0, 0)))

    @cached_property
    def phi(self) -> Array:
        """Values of the own columns [drive units], zero if they are left out, shape (n, f)."""
        phi = self.model.inverse @ self.c[..., None] + self._to_phi @ self.rest[..., None]
        return np.where(self.model.own.used, phi[..., 0], 0.0)

    def friction(self, joint: int) -> dict[tuple[str, int], float]:
        """Values of a joint's own columns by name and motion, -1 for all motions."""
        own = zip(self.model.names, self.phi[joint].tolist(), self.model.own.used[joint], strict=True)
        return {name: value for name, value, used in own if used}

    def common(self, name: str, otherwise: float) -> Array:
        """Values of an own column that is common to all motions, or a default for joints without it, shape (n,)."""
        if (name, -1) not in self.model.names:
            return np.full(len(self.h), otherwise)
        k = self.model.names.index((name, -1))
        return np.where(self.model.own.used[:, k], self.phi[:, k], otherwise)

    @cached_property
    def J(self) -> Array:
        """Derivative of [Z k] (h z, h) by u, shape (n, k + 1, n + k)."""
        n, k = len(self.h), len(self.z)
        J, j = np.zeros((n, k + 1, n + k)), np.arange(n)
        J[:, np.arange(k), n + np.arange(k)] = self.h[:, None]
        J[j, :k, j], J[j, k, j] = self.h[:, None] * self.z, self.h
        return J

    @cached_property
    def XJ(self) -> Array:
        """Derivative of -c by u, shape (n, f, n + k)."""
        return self.model.eliminated[1][:, :, :-1] @ self.J

    @cached_property
    def normal(self) -> Array:
        """Cross products of the derivatives by u, without own columns, with priors, shape (n + k, n + k)."""
        n, P, S = len(self.h), self.model.blocks.prior, self.model.eliminated[2][:, :-1, :-1]
        N = np.sum(flipped(self.J) @ S @ self.J, axis=0)
        N[n:, n:] += P.T @ P
        N[:n, :n] += np.diag(self.log_std**-2.0)
        return N

    @cached_property
    def _scale(self) -> Array:
        return 1.0 / np.sqrt(np.diag(self.normal))

    @cached_property
    def covariance(self) -> Array:
        """Inverse of `normal`."""
        return np.linalg.inv(self.normal * np.outer(self._scale, self._scale)) * np.outer(self._scale, self._scale)

    @cached_property
    def without_blocks(self) -> tuple[Array, Array, Array]:
        """Change of u (B, n + k) and of c (n, B, f) without each time block, and squares of its prediction (n, B).

        The squares are those of the rows weighted by 1 / sigma_j. Own columns are eliminated joint by joint.
        """
        model, n, k = self.model, len(self.h), len(self.z)
        RR, FR, FF = model.blocks.RR, model.FR, model.FF
        eF, eR, tz = -self.c[:, None, :, None], self.rest[:, None, :, None], np.append(self.z, (1.0, 0.0))
        both = RR @ np.stack((self.rest, np.tile(tz, (n, 1))), axis=2)[:, None]  # (n, B, k + 2, 2)
        GF, GR = FF @ eF + FR @ eR, flipped(FR) @ eF + both[..., :1]  # cross products with the residual of the block
        HF, HR = model.eliminated[0][:, None] - FF, np.sum(FR, axis=1, keepdims=True)[..., :-1] - FR[..., :-1]
        i, d = np.arange(HF.shape[-1]), np.arange(n + k)
        HF[:, :, i, i] += FREE_BLOCK
        inverse = np.linalg.inv(HF)
        X, y = inverse @ HR, inverse @ GF
        h2 = (self.h / model.sigma) ** 2
        total = model.blocks.total[:, :-1]
        inner = np.tensordot(h2, total[:, :k, :k], 1) - np.tensordot(h2, RR, 1)[:, :k, :k]
        by_block = HR[..., :k].transpose(1, 3, 0, 2).reshape(len(inner), k, -1)  # (B, k, n f)
        weighted = (h2[:, None, None, None] * X[..., :k]).transpose(1, 0, 2, 3).reshape(len(inner), -1, k)
        St = (total @ tz)[:, None] - both[..., :-1, 1] - (flipped(HR) @ (X @ tz[:-1])[..., None])[..., 0]
        St *= h2[:, None, None]
        N = np.zeros((len(inner), n + k, n + k))
        N[:, n:, n:] = inner - by_block @ weighted + model.blocks.prior.T @ model.blocks.prior
        N[:, :n, n:] = St[..., :k].swapaxes(0, 1)
        N[:, n:, :n] = flipped(N[:, :n, n:])
        N[:, d[:n], d[:n]] = (St @ tz[:-1]).T + self.log_std**-2.0
        N *= np.outer(self._scale, self._scale)
        N[:, d, d] += FREE_BLOCK
        g = (GR[:, :, :-1] - flipped(HR) @ y)[..., 0] * (self.h / model.sigma**2)[:, None, None]
        g = np.concatenate(((g @ tz[:-1]).T, np.sum(g[..., :k], axis=0)), axis=1)
        du = np.linalg.solve(N, (self._scale * g)[..., None])[..., 0] * self._scale
        dR = np.pad(self._moved(du), ((0, 0), (0, 0), (0, 1)))[..., None]
        dF = y - X @ dR[:, :, :-1]
        squares = np.sum(eF * GF, axis=(2, 3)) + np.sum(eR * GR, axis=(2, 3))
        squares += np.sum(dF * (2.0 * GF + FF @ dF + 2.0 * (FR @ dR)), axis=(2, 3))
        squares += np.sum(dR * (2.0 * GR + RR @ dR), axis=(2, 3))
        return -du, -dF[..., 0], np.maximum(squares, 0.0) / model.sigma[:, None] ** 2

    def _moved(self, du: Array) -> Array:
        """Change of the torque's coordinates (h z, h) of each joint by changes of u (B, n + k), shape (n, B, k + 1)."""
        ds, dz = du[:, : len(self.h)].T[..., None], du[:, len(self.h) :]
        return self.h[:, None, None] * np.concatenate((ds * self.z + dz, ds), axis=2)

    @cached_property
    def residual(self) -> Array:
        """Residuals [drive units], padded, shape (n, B, w)."""
        left = self.model.blocks.times(self.rest[:, None, :, None]) - self.model.own.Q @ self.c[:, None, :, None]
        return left[..., 0]

    @property
    def fitted_currents(self) -> Array:
        """Currents of the rows without their residuals [drive units], shape (r,)."""
        blocks = self.model.blocks
        return blocks.rows_of_currents - blocks.layout.rows(self.residual[..., None])[:, 0]

    def predicted(self) -> Array:
        """Errors of the prediction of each time block from the others [drive units], padded, shape (n, B, w)."""
        du, dc, _ = self.without_blocks
        moved = self.model.blocks.times(self._moved(du)[..., None]) + self.model.own.Q @ dc[..., None]
        return self.residual - moved[..., 0]

    @cached_property
    def data(self) -> Array:
        """Cross products of [Q Z k] without priors, shape (n, f + k + 1, f + k + 1)."""
        FR = np.sum(self.model.FR, axis=1)[..., :-1]
        top = np.concatenate((np.sum(self.model.FF, axis=1), FR), axis=2)
        low = np.concatenate((flipped(FR), self.model.blocks.total[:, :-1, :-1]), axis=2)
        return np.concatenate((top, low), axis=1)

    @cached_property
    def unknowns(self) -> Array:
        """Number of unknowns of each joint, with a share of common ones and without what priors determine, (n,)."""
        f = len(self.model.names)
        inner = np.concatenate((-self.XJ, self.J), axis=1)
        FF, own = self.model.eliminated[0], self.data[:, :f, :f]
        shared = np.einsum("jxu,jxy,jyv,uv->j", inner, self.data, inner, self.covariance, optimize=True)
        return np.einsum("jaa->j", np.linalg.solve(FF, own)) + shared / self.model.sigma**2

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of each joint's residual (eq. 19) [drive units], shape (n,)."""
        return np.linalg.norm(self.residual, axis=(1, 2)) / np.sqrt(self.model.blocks.layout.counts - self.unknowns)

    @cached_property
    def log_h(self) -> "Sensitivity":
        """Of log|h|, n quantities."""
        n, k, f = len(self.h), len(self.z), len(self.model.names)
        return Sensitivity(self, np.eye(n, n + k), np.zeros((n, n, f)))

    def of_theta(self, at: Indices | slice = slice(None)) -> "Sensitivity":
        """Of shared parameters."""
        U = self.model.blocks.U[at]
        n, f = len(self.h), len(self.model.names)
        return Sensitivity(self, np.hstack((np.zeros((len(U), n)), U)), np.zeros((len(U), n, f)))

    def of_phi(self, weights: Array) -> "Sensitivity":
        """Of weighted sums of own coefficients, weights (q, n, f)."""
        weights = weights * self.model.own.used
        by_c = np.einsum("qjf,jfg->qjg", weights, self.model.inverse)
        moved = self._to_phi[:, :, :-1] @ self.J
        return Sensitivity(self, -np.einsum("qjf,jfu->qu", weights, moved), by_c)

    def of_own(self, joints: Sequence[int] | Indices, columns: Sequence[int] | Indices) -> "Sensitivity":
        """Of single own coefficients, by joint and column, q of each."""
        weights = np.zeros((len(joints), *self.phi.shape))
        weights[np.arange(len(joints)), joints, columns] = 1.0
        return self.of_phi(weights)

    def of_joint(self, joint: int) -> "Sensitivity":
        """Of a joint's own coefficients, those of `friction`."""
        used = np.flatnonzero(self.model.own.used[joint])
        return self.of_own(np.full(len(used), joint), used)

    @cached_property
    def rows(self) -> Rows:
        """Rows of all joints with their residuals and the basis of their column space."""
        columns, model, n = self.ready.columns, self.model, len(self.h)
        f, k = len(model.names), len(self.z)
        layout, sigma = model.blocks.layout, model.sigma
        try:
            root = np.linalg.inv(np.linalg.cholesky(self.normal * np.outer(self._scale, self._scale)))
        except np.linalg.LinAlgError:
            raise NotIdentifiable(
                "the rows do not determine the gains with what is unknown beside; record longer, or state more of it"
            ) from None
        inner = np.concatenate((-self.XJ, self.J), axis=1) * self._scale @ root.T / sigma[:, None, None]
        own = np.linalg.inv(np.linalg.cholesky(model.eliminated[0])).swapaxes(1, 2)
        shared = model.own.Q @ inner[:, None, :f] + model.blocks.times(inner[:, None, f:])
        ends, parts = np.concatenate(([0], np.cumsum(layout.counts))).tolist(), list[Part]()
        for j, (mine, used) in enumerate(zip(model.own.Q @ own[:, None], model.own.used, strict=True)):
            at = slice(ends[j], ends[j + 1])
            Q = flat(np.concatenate((shared[j], mine[..., used]), axis=2)[None])[0]
            number = np.concatenate((np.arange(n + k), n + k + np.flatnonzero(used) + j * f))
            parts.append(Part(at, number, Q[layout.place[at] - j * len(Q)]))
        return Rows(
            V=model.blocks.rows_of_currents,
            residual=layout.rows(self.residual[..., None])[:, 0],
            joint=columns.joint,
            motion=columns.motion,
            position=columns.position,
            unknowns=dict(enumerate(self.unknowns.tolist())),
            weight=1.0 / sigma[columns.joint],
            explained=Basis((len(layout.place), n + k + n * f), tuple(parts)),
        )


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of q quantities by u and c, and from them by the currents of rows and by priors."""

    fit: Fit  # the fit
    by_u: Array  # shape (q, n + k)
    by_c: Array  # shape (q, n, f)

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        """Derivatives times the inverse of the normal matrix of all unknowns: u, and c (n, q, f)."""
        fit, by_c = self.fit, self.by_c.swapaxes(0, 1)
        FF = fit.model.eliminated[0]
        u = (self.by_u - np.sum(by_c @ fit.XJ, axis=0)) @ fit.covariance
        c = fit.model.sigma[:, None, None] ** 2 * np.linalg.solve(FF, flipped(by_c)).swapaxes(1, 2)
        return u, c - u @ flipped(fit.XJ)

    @cached_property
    def _by_columns(self) -> Array:
        """Coefficients of [Q Z k] in the derivative by the currents, shape (n, q, f + k + 1)."""
        u, c = self._solved
        return np.concatenate((c, u @ flipped(self.fit.J)), axis=2) / self.fit.model.sigma[:, None, None] ** 2

    @cached_property
    def influence(self) -> Array:
        """Derivative by the current of each row, shape (q, r)."""
        model, f = self.fit.model, self.by_c.shape[2]
        x = flipped(self._by_columns)[:, None]
        return model.blocks.layout.rows(model.own.Q @ x[:, :, :f] + model.blocks.times(x[:, :, f:])).T

    @cached_property
    def belief(self) -> Array:
        """Change per standard deviation of each prior: of own parameters, shared ones, the n log|h|, (q, priors)."""
        (u, c), fit, n = self._solved, self.fit, len(self.fit.h)
        believed = np.isfinite(fit.model.std).ravel()
        own = (c @ flipped(fit.model.prior)).swapaxes(0, 1).reshape(len(u), believed.size)[:, believed]
        return np.hstack((own, u[:, n:] @ fit.model.blocks.prior.T, u[:, :n] / fit.log_std))

    def beside(self, other: "Sensitivity") -> "Sensitivity":
        """Of these quantities and others of the same fit."""
        by_u, by_c = np.vstack((self.by_u, other.by_u)), np.concatenate((self.by_c, other.by_c))
        return Sensitivity(self.fit, by_u, by_c)

    @cached_property
    def from_data(self) -> Array:
        """Covariance from the residuals, the larger of two estimates, shape (q, q)."""
        return larger_of(self.classical(), self.jackknife())

    @cached_property
    def covariance(self) -> Array:
        """Covariance from residuals and priors, shape (q, q)."""
        return self.from_data + self.belief @ self.belief.T

    @property
    def std(self) -> Array:
        """Standard deviations from residuals and priors, shape (q,)."""
        return deviations(self.covariance)

    def classical(self) -> Array:
        """Covariance for white residuals with one standard deviation per joint (eq. 20), shape (q, q)."""
        x = self._by_columns * self.fit.sigma[:, None, None]
        return np.sum(x @ self.fit.data @ flipped(x), axis=0)

    def jackknife(self) -> Array:
        """Covariance from fits without a time block, shape (q, q)."""
        du, dc, _ = self.fit.without_blocks
        return of_changes(du @ self.by_u.T + np.einsum("jbf,qjf->bq", dc, self.by_c))


def fit(ready: Setting, terms: Mapping[str, Term], before: Fit | None) -> Fit:
    """Fit the model with further friction terms, from an earlier fit if there is one; raises `NotIdentifiable`."""
    model = Model.of(ready, terms)
    std = np.full(ready.n, ready.prior_std)
    std[[each.joint for each in ready.given]] = GIVEN_STD
    h = ready.start if before is None else before.h
    model, first = search(model, h, np.log(np.abs(h)), std)
    mean = np.log(np.abs(first.h))  # the prior about the minimum does not bias identifiable gains
    model, found = search(model, first.h, mean, std)
    return Fit(ready=ready, model=model, h=found.h, z=found.z, mean=mean, log_std=std, cost=found.cost)


def improvement(better: Fit, than: Fit) -> Array:
    """Reduction of the squares of predictions of omitted blocks, by the weights of the worse fit, shape (n, B)."""
    same = (better.model.sigma / than.model.sigma)[:, None] ** 2
    return than.without_blocks[2] - same * better.without_blocks[2]


def solution(ready: Setting, final: Fit, model: Array) -> GainSolution:
    """Return the gains of a fit, whose currents may differ from those of the problem.

    `model` is the relative change of each gain per standard deviation of each assumption beside its priors, (n, m).
    """
    columns, log_h, n, names = ready.columns, final.log_h, ready.n, [name for name, _ in final.model.names]
    F, joint = final.model.F, columns.joint
    size = np.zeros((n, 2, n, len(names)))  # of both kinds of friction together, and of Coulomb friction
    for j in range(n):
        own, used = F[joint == j], final.model.own.used[j]
        for k in (k for k, name in enumerate(names) if name != "off" and used[k] and name in OWN):
            many = sum(name == names[k] and on for name, on in zip(names, used, strict=True))
            size[j, : 2 if names[k] == "Fc" else 1, j, k] = rms(own[own[:, k] != 0.0, k]) / many
    weights = size.reshape(2 * n, n, -1)
    return GainSolution(
        rows=replace(final.rows, V=columns.V),
        joints=np.arange(n),
        inverse=final.h,
        influence=final.h[:, None] * log_h.influence,
        payload=(log_h.influence * final.h[joint]) @ ready.spread,
        model=np.hstack((log_h.belief, model)),
        load_rms=np.array([rms(ready.k[columns.loaded & (joint == j)]) for j in range(n)]),
        friction=np.einsum("qjf,jf->q", weights, final.phi).reshape(n, 2),
        friction_influence=final.of_phi(weights).influence.reshape(n, 2, -1),
        unsolved={},
    )
