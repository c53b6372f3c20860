"""A problem, prepared for fits of all joints with various terms: its columns, initial values, and reduction.

Initial gains are those of joints that determine theirs alone; the others follow from the link parameters that they
share with these, with signs by friction, which brakes. Rows are weighted by 1 / sigma_j, from a fit of joint j alone:
with weights from the residual at the estimated gains, an infinite gain would be a solution.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ident.estimation.blocks import DEPENDENT_ALONE, NOTHING, ROUNDING, Blocks, Own, flat, flipped, orthonormalising
from ident.estimation.estimate import largest
from ident.estimation.intervals import Layout, time_blocks
from ident.estimation.joint_by_joint import JointFit, joint_fit
from ident.estimation.problem import Columns, Problem, SharedParameters, Stacked
from ident.estimation.sweep import Sweep
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

SURE_Z = 6.0
"""Number of standard deviations at which a joint's own estimate of its gain is used as initial value."""
SMALL = 1e-12
"""Relative eigenvalue of cross products below which initial values do not use a combination of parameters."""


@dataclass(frozen=True, slots=True)
class GivenGain:
    """A known gain, which sets the scale of the others: its joint, from 0, and its value [N m / drive unit]."""

    joint: int
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A further column of the friction of all joints."""

    column: Array  # rows of all joints, shape (r,); zero in those of joints without the term
    mean: float = 0.0  # prior mean of each joint's coefficient
    std: float = float("inf")  # prior standard deviation, infinite without a prior


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """A problem, prepared for fits with various terms."""

    problem: Problem  # motions and payloads
    shared: SharedParameters  # the parameters that joints share
    columns: Stacked  # rows of all joints
    k: Array  # torque of the known payload parameters [N m], shape (r,)
    spread: Array  # change of k per factor of their covariance, shape (r, m)
    names: tuple[tuple[str, int], ...]  # name and motion of the columns of friction and offset, b pairs
    F: Array  # those columns, shape (r, b)
    blocks: Blocks  # the rows with cross products
    alone: Array  # 1/g of the joints that determine it alone, zero for the others, shape (n,)
    start: Array  # initial values of 1/g, shape (n,)
    prior_std: float  # prior standard deviation of log|h| about the initial value
    given: tuple[GivenGain, ...]  # known gains
    sweeps: tuple[Sweep, ...]  # torques along each motion, if all are recorded
    # change of torque per compliance of each joint, from torques of rigid joints, shape (r, n); empty if not known:
    softened: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.alone)

    @property
    def recorded(self) -> bool:
        """Whether every motion has its recording, which columns that follow from torques need."""
        return bool(self.sweeps)

    def with_gains(self, given: Sequence[GivenGain]) -> "Setting":
        """Return the same problem with other known gains."""
        start = _start(self, given)
        return replace(self, given=tuple(given), start=start, blocks=self.blocks.at(start / self.sigma))

    def restarted(self) -> "Setting":
        """Return the same problem with initial values from all its columns."""
        return replace(self, start=_start(self, self.given))

    def with_currents(self, V: Array) -> "Setting":
        """Return the same problem with other currents (r,)."""
        return replace(self, columns=replace(self.columns, V=V), blocks=self.blocks.with_currents(V))

    def widened(self, more: Array, std: Array | float = np.inf, independent: Array | None = None) -> "Setting":
        """Append shared columns (r, m) with their prior standard deviations (m,); arguments as `Blocks.widened`."""
        if not more.shape[1]:
            return self
        blocks = self.blocks.widened(more, np.full(more.shape[1], std), independent)
        return replace(self, blocks=blocks)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of the residual of each joint alone [drive units], shape (n,)."""
        return sigma_of(self.blocks, self.blocks.alone.left, self.blocks.alone.rank)


def sigma_of(blocks: Blocks, left: Array, rank: Indices) -> Array:
    """Return the standard deviation of each joint's residual (n, B w) of a fit of some rank, shape (n,)."""
    counts = blocks.layout.counts
    rms = np.linalg.norm(blocks.currents, axis=1) / np.sqrt(counts)
    return np.maximum(np.linalg.norm(left, axis=1) / np.sqrt(np.maximum(counts - rank, 1)), ROUNDING * rms)


def setting(problem: Problem, *, per_motion: bool, prior_std: float, given: Sequence[GivenGain] | None = ()) -> Setting:
    """Prepare the fits of a problem, with viscous and Coulomb friction of all motions or of each.

    Without a scale of the gains, `given` is None: the gain of the joint with the most significant friction is 1, signed
    so that friction brakes. Raises `NotIdentifiable` if neither a known payload parameter nor a given gain sets the
    scale, or a joint has fewer rows than unknowns.
    """
    shared = SharedParameters.of(problem)
    if given is not None and not given and not shared.known.any():
        raise NotIdentifiable(
            "no motion carries a payload of known mass, so only ratios of gains are identifiable; mount "
            "one, or give one gain (options gain_joint and gain_value)"
        )
    columns = Columns.of(problem.motions)
    A, k = shared.columns(columns)
    names, F = columns.friction(per_motion=per_motion)
    spread = [W_L @ each.spread for W_L, each in zip(columns.W_L, shared.parts, strict=True)]
    spread, p = np.hstack([A[:, :0], *spread]), A.shape[1]
    A = np.hstack((A, k[:, None], columns.V[:, None], *columns.W_L))
    columns = columns.stacked  # without W and W_L, which are large for long logs
    sweeps = tuple(Sweep(problem, shared, number) for number in range(len(problem.motions)))
    recorded = all(motion.observation.full_rate is not None for motion in problem.motions)
    block = time_blocks(columns.motion, columns.position)
    layout = Layout.of(problem.structure.arm.n, columns.joint, block, int(block.max(initial=0)) + 1)
    blocks = Blocks.of(layout, F, A, p)
    del A
    check_rows(blocks, blocks.own)
    h = np.zeros(problem.structure.arm.n)
    for j in range(len(h)) if shared.parts else ():
        fit = joint_fit(problem, j, shared.parts)
        if isinstance(fit, JointFit) and abs(fit.inverse) > SURE_Z * float(fit.fit.std[-1]):
            h[j] = fit.inverse
    ready = Setting(
        problem=problem, shared=shared, columns=columns, k=k, spread=spread, names=names, F=F, blocks=blocks,
        alone=h, start=h, prior_std=prior_std, given=(), sweeps=sweeps if recorded else (),
    )  # fmt: skip
    if given is None:
        z = friction_z(ready)
        surest = int(np.argmax(np.abs(z)))
        given = [GivenGain(surest, -1.0 if z[surest] < 0.0 else 1.0)]
    return ready.with_gains(given)


def check_rows(blocks: Blocks, own: Own) -> None:
    """Raise `NotIdentifiable` unless each joint has more rows than columns, with known torque and current."""
    for j, (rows, f) in enumerate(zip(blocks.layout.counts.tolist(), own.used.sum(axis=1).tolist(), strict=True)):
        if rows <= (need := f + len(blocks.std) + 2):
            raise NotIdentifiable.too_few_rows(rows, need, j)


def friction_z(ready: Setting) -> Array:
    """Return the more significant of Coulomb and viscous friction of each joint alone, in standard deviations, (n,).

    Its sign is that of the gain, as friction brakes; it is zero without friction.
    """
    blocks, inner = ready.blocks, len(ready.blocks.std) + 1
    C, gram = blocks.C[:, :, :inner], blocks.cross[:, :inner, :inner]
    size = np.sqrt(np.einsum("jaa->ja", gram) + np.sum(C**2, axis=1))
    size = np.where(size > 0.0, size, 1.0)
    T = orthonormalising(gram / (size[:, :, None] * size[:, None]), DEPENDENT_ALONE) / size[:, :, None]
    along, inverse = C @ T, np.linalg.inv(blocks.own.R)
    phi = inverse @ (blocks.C[:, :, -1:] - along @ (flipped(T) @ blocks.cross[:, :inner, -1:]))
    spread = np.linalg.norm(np.concatenate((inverse, inverse @ along), axis=2), axis=2) * ready.sigma[:, None]
    friction = np.array([name != "off" for name, _ in ready.names]) & blocks.own.used
    return largest(np.where(friction, phi[..., 0] / spread, 0.0))


def _start(ready: Setting, given: Sequence[GivenGain]) -> Array:
    """Return 1/g of joints alone, and of the others from link parameters shared with these, shape (n,)."""
    h = ready.alone.copy()
    for each in given:
        h[each.joint] = 1.0 / each.value
    gram = ready.blocks.cross / (ready.sigma**2)[:, None, None]
    A, V = gram[:, :-2], gram[:, -1]  # products with [A k V]
    sign = np.where(h != 0.0, np.sign(h), np.where(friction_z(ready) < 0.0, -1.0, 1.0))
    if not h.any():  # the scale is free: one joint has 1
        loudest = int(np.argmax(V[:, -1]))
        h[loudest] = sign[loudest]
    while not h.all():
        normal = np.tensordot(h**2, A[:, :, :-2], 1)
        size = np.sqrt(np.diag(normal))
        shown = size > NOTHING * size.max(initial=0.0)  # gravity about a vertical axis is rounding error
        scale = np.where(shown, 1.0 / np.where(shown, size, 1.0), 0.0)
        inverse = np.linalg.pinv(normal * np.outer(scale, scale), rcond=SMALL, hermitian=True)
        theta = scale * (inverse @ (scale * (h @ A[:, :, -1] - h**2 @ A[:, :, -2])))
        x = np.append(theta, 1.0)  # torque of each joint [A k] x
        length = np.sqrt(np.maximum(np.einsum("a,jab,b->j", x, gram[:, :-1, :-1], x), 0.0))
        along = V[:, :-1] @ x / np.where(length > 0.0, length, 1.0) ** 2
        loud = np.maximum(np.sqrt(V[:, -1]), 1e-300)
        explained = np.where(h == 0.0, np.abs(along) * length / loud, -1.0)
        best = int(np.argmax(explained))  # the joint with the best fit is added first
        if length[best] > 0.0:
            size = abs(along[best]) if along[best] * sign[best] > 0.0 else loud[best] / length[best]
        else:  # no joint before it shows any torque of this one
            size = np.abs(h).max()
        h[best] = sign[best] * (float(size) or 1.0)
    return h


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """The model with some terms, f own columns and k shared coordinates, reduced to cross products."""

    blocks: Blocks  # rows with their cross products
    names: tuple[tuple[str, int], ...]  # name and motion of each own column, f pairs
    own: Own  # own columns, those of `blocks` first
    F: Array  # the columns as given, shape (r, f)
    mean: Array  # prior mean of each coefficient, shape (n, f)
    std: Array  # prior standard deviation, infinite without a prior, shape (n, f)

    @classmethod
    def of(cls, ready: Setting, terms: Mapping[str, Term]) -> "Model":
        """Of a problem and further terms; raises `NotIdentifiable`."""
        blocks, n, b, e = ready.blocks, ready.n, len(ready.names), len(terms)
        F = np.column_stack((ready.F, *(term.column for term in terms.values())))
        own = blocks.own.extended(blocks.layout.padded(F[:, b:]))
        check_rows(blocks, own)
        mean, std = np.zeros((n, b + e)), np.full((n, b + e), np.inf)
        for k, term in enumerate(terms.values(), b):
            on = own.used[:, k]
            mean[on, k], std[on, k] = term.mean, term.std
        names = (*ready.names, *((name, -1) for name in terms))
        return cls(blocks=blocks, names=names, own=own, F=F, mean=mean, std=std)

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of the residual of each joint alone [drive units], shape (n,)."""
        alone = self.blocks.alone
        new = alone.outside(flat(self.own.Q[..., self.blocks.own.Q.shape[-1] :]))
        T = orthonormalising(flipped(new) @ new, DEPENDENT_ALONE)
        new = new @ T
        left = alone.left - (new @ (flipped(new) @ alone.left[..., None]))[..., 0]
        return sigma_of(self.blocks, left, alone.rank + np.count_nonzero(T.any(axis=1), axis=1))

    @cached_property
    def FF(self) -> Array:
        """Cross products of own columns, shape (n, B, f, f)."""
        b = self.blocks.own.Q.shape[-1]
        FF = np.zeros((*self.own.Q.shape[:2], len(self.names), len(self.names)))
        FF[:, :, :b, :b] = self.blocks.FF
        FF[:, :, b:] = flipped(self.own.Q[..., b:]) @ self.own.Q
        FF[:, :, :b, b:] = flipped(FF[:, :, b:, :b])
        return FF

    @cached_property
    def FR(self) -> Array:
        """Cross products of own columns with [Z k V], shape (n, B, f, k + 2)."""
        b = self.blocks.own.Q.shape[-1]
        return np.concatenate((self.blocks.FR, flipped(self.blocks.against(self.own.Q[..., b:]))), axis=2)

    @cached_property
    def inverse(self) -> Array:
        """R^-1 of the own columns, phi = R^-1 c + .., shape (n, f, f)."""
        return np.asarray(np.linalg.inv(self.own.R), np.float64)

    @cached_property
    def prior(self) -> Array:
        """Rows of the priors of own coefficients by c, in standard deviations, shape (n, f, f); zero without one."""
        return np.where(np.isfinite(self.std)[..., None], self.inverse / self.std[..., None], 0.0)

    @cached_property
    def eliminated(self) -> tuple[Array, Array, Array]:
        """Cross products of c with priors, X with c = X rest, and weighted ones of [Z k V] without own columns."""
        s2 = self.sigma[:, None, None] ** 2
        G = self.prior
        m = np.where(np.isfinite(self.std), self.mean / self.std, 0.0)[..., None]
        FF = np.sum(self.FF, axis=1) + s2 * (flipped(G) @ G)
        i = np.arange(FF.shape[1])
        FF[:, i, i] += ~self.own.used
        FR, RR = np.sum(self.FR, axis=1), self.blocks.total / s2
        FR[:, :, -1:] += s2 * (flipped(G) @ m)
        RR[:, -1:, -1:] += flipped(m) @ m
        X = np.linalg.solve(FF, FR)
        return FF, X, RR - flipped(FR) @ X / s2
