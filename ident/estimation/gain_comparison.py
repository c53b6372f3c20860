"""Comparison of two sets of gains of one kind of robot: significant changes, of each joint and of all together.

x = log |g_B / g_A| has covariance C, the sum of those of both sets. A change common to all joints, as from an error of
the payload's mass or another supply voltage, is separated: s = (1^T C^-1 x) / (1^T C^-1 1), the generalised mean. As
one changed joint would bias it, s is that of the largest set of joints with a common change if not all joints have one.
"""

from dataclasses import dataclass
from itertools import combinations
from statistics import NormalDist

import numpy as np
import scipy
from scipy import linalg

from ident.estimation.known_gains import KnownGains, same_joint
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import GainsError

LEVEL = 0.05
"""Probability of a false alarm on any joint."""
APART = 1e-3
"""Significance level at which joints are said to have no common change."""
MOST_APART = 3
"""Largest number of joints without the common change; also fewer than half."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moved:
    """Change of a gain."""

    rel_change: float  # relative change of its magnitude, |g_B / g_A| - 1
    std: float  # standard deviation of log |g_B / g_A|, for small changes equal to that of the relative change
    rel_std: float  # standard deviation of `rel_change`, `std` times |g_B / g_A|; relative
    turned: bool  # whether the sign of the gain changed
    moved: bool  # whether the change is significant


def changes(log: Array, std: Array, turned: Mask, limit: float) -> tuple[Moved, ...]:
    """Return changes log |g_B / g_A|, significant beyond `limit` standard deviations or if the sign changed."""
    each = zip(log.tolist(), std.tolist(), turned.tolist(), strict=True)
    return tuple(
        Moved(
            rel_change=float(np.expm1(x)), std=s, rel_std=float(np.exp(x)) * s, turned=t, moved=t or abs(x) > limit * s
        )
        for x, s, t in each
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Together:
    """A test of all joints together."""

    chi2: float  # sum of the squared changes over their standard deviations, with correlations between joints
    freedom: int  # degrees of freedom
    p: float  # probability of a value at least as large without a change

    @classmethod
    def of(cls, chi2: float, freedom: int) -> "Together":
        """Of a sum of squares."""
        chi2 = max(chi2, 0.0)
        return cls(chi2=chi2, freedom=freedom, p=float(scipy.special.chdtrc(freedom, chi2)))

    @property
    def moved(self) -> bool:
        """Whether the change is significant."""
        return self.p < LEVEL


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainComparison:
    """Changes from one set of gains to another."""

    joints: Indices  # the k joints that have a gain in both, from 0, shape (k,)
    each: tuple[Moved, ...]  # change of each joint
    together: Together  # test of no change at all
    scale: Moved  # change common to all joints, or to the largest set with a common change
    sharing: Indices  # joints, from 0, with this change: all, or more than half; empty if there is no such set
    apart: tuple[Moved, ...]  # change of each joint relative to the common one
    pattern: Together | None  # test of a change common to all joints; None for a single joint
    # joints, from 0, with a gain in only one set, and the name of that set, `A` or `B`:
    missing: tuple[tuple[int, str], ...]
    limit: float  # number of standard deviations beyond which a joint's change is significant

    @property
    def moved(self) -> bool:
        """Whether any change is significant, of all joints together or of one."""
        return self.together.moved or any(one.moved for one in self.each)


def compared(A: KnownGains, B: KnownGains) -> GainComparison:
    """Compare two independent sets of gains.

    Raises `GainsError` if the joints differ, no joint has a gain in both, or a change has no standard deviation.
    """
    if len(A.names) != len(B.names) or not all(map(same_joint, range(1, len(A.names) + 1), A.names, B.names)):
        raise GainsError(
            f"the two sets have different joints: {', '.join(A.names)} against {', '.join(B.names)}; "
            "compare robots of one kind"
        )
    joints, a, b = np.intersect1d(A.joints, B.joints, return_indices=True)
    if not len(joints):
        raise GainsError("no joint has a gain in both sets; nothing can be compared")
    C = A.log_covariance[np.ix_(a, a)] + B.log_covariance[np.ix_(b, b)]
    std = np.sqrt(np.diag(C))
    if not std.all():
        joint = int(joints[np.argmin(std)]) + 1
        raise GainsError(f"joint {joint}: neither gain has a standard deviation, so no change can be tested; state one")
    x, turned = np.log(np.abs(B.value[b] / A.value[a])), A.value[a] * B.value[b] < 0.0
    everyone, sharing = common_scale(x, C), sharing_joints(x, C)
    used = sharing if len(sharing) else np.arange(len(x))
    common, w = common_scale(x[used], C[np.ix_(used, used)]), np.zeros(len(x))
    w[used] = common.weights
    apart = np.eye(len(x)) - w  # x - s
    left = np.sqrt(np.maximum(np.diag(apart @ C @ apart.T), 0.0))
    limit, of_one = (-NormalDist().inv_cdf(0.5 * LEVEL / many) for many in (len(x), 1))
    (scale,) = changes(np.array([common.value]), np.array([common.std]), np.zeros(1, np.bool_), of_one)
    return GainComparison(
        joints=joints.astype(np.intp),
        each=changes(x, std, turned, limit),
        together=Together.of(everyone.rest.chi2 + (everyone.value / everyone.std) ** 2, len(x)),
        scale=scale,
        sharing=joints[sharing].astype(np.intp),
        apart=changes(apart @ x, left, turned, limit),
        pattern=everyone.rest if len(x) > 1 else None,
        missing=tuple(
            (j, "A" if j in A.joints else "B") for j in np.setxor1d(A.joints, B.joints).astype(np.intp).tolist()
        ),
        limit=limit,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CommonScale:
    """A change common to k joints, s = w^T x: s, its standard deviation, w (k,), and a test of the rest of x."""

    value: float
    std: float
    weights: Array
    rest: Together


def common_scale(x: Array, C: Array) -> CommonScale:
    """Return the common change of k joints, from x (k,) with covariance C (k, k); `GainsError` if C is singular."""
    try:
        L = linalg.cholesky(C, lower=True)
    except linalg.LinAlgError:
        raise GainsError("the covariance of the gains is singular; state a standard deviation of each") from None
    white = np.asarray(linalg.solve_triangular(L, np.column_stack((np.ones(len(x)), x)), lower=True), np.float64)
    ones, y = white[:, 0], white[:, 1]
    weight = float(ones @ ones)
    value = float(ones @ y) / weight
    rest = Together.of(float(y @ y) - value**2 * weight, max(len(x) - 1, 1))
    weights = np.asarray(linalg.solve_triangular(L, ones, lower=True, trans=1), np.float64) / weight
    return CommonScale(value=value, std=weight**-0.5, weights=weights, rest=rest)


def sharing_joints(x: Array, C: Array) -> Indices:
    """Return the largest set, more than half of the joints, whose changes are one common change; empty if none.

    x has shape (k,), its covariance C shape (k, k). Of sets of one size, the one with the best fit is returned.
    """
    for many in range(min((len(x) - 1) // 2, MOST_APART) + 1):
        kept = [np.setdiff1d(np.arange(len(x)), out) for out in combinations(range(len(x)), many)]
        tests = [common_scale(x[each], C[np.ix_(each, each)]).rest for each in kept]
        best = int(np.argmin([test.chi2 for test in tests]))
        if tests[best].p >= APART:
            return kept[best].astype(np.intp)
    return np.zeros(0, dtype=np.intp)
