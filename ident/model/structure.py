"""Identifiable structure of an arm from its kinematics: base parameters, and which of them act on each joint.

Base parameters are independent columns of the standard regressor with their regroupings (paper, eq. 11). The columns
are tested on random states instead of measured data: linear dependence is a property of the kinematics, while filtered
data have rounding errors. Pivoted QR factorises groups of columns in order of preference (Gautier 1991, with the
preference of Khalil's regrouping rules), so that the parameters are those of the literature: YY, MZ and M of a revolute
link are regrouped into their neighbours, and Ia into ZZ if possible.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np
from scipy import linalg

from ident.model.arm import Arm, arm_from_pinocchio
from ident.model.parameters import COUPLING, INERTIAL, STANDARD, labels
from ident.model.regressor import regressor
from ident.support.arrays import Array, Indices, readonly
from ident.support.errors import RobotModelError

if TYPE_CHECKING:
    import pinocchio as pin  # pyright: ignore[reportMissingImports]

PROBE_SEED = 20110930
"""Seed of the random states; any other gives the same structure."""
TIERS = (("XX", "XY", "XZ", "YZ", "ZZ", "MX", "MY"), ("Ia",), ("YY", "MZ", "M"), ("Fv", "Fc", "off", *COUPLING))
NO_DRIVES: Mapping[str, Array] = {}
RANK_TOL = 1e-8
"""Smallest independent part of a unit column: exact dependence gives 1e-15, the weakest base column 1e-3."""


@dataclass(frozen=True, slots=True, eq=False)
class BaseParameters:
    """Independent columns, b among p, and the others' regrouping: `W_st @ chi_st == W_st[:, columns] @ chi_base`."""

    columns: Indices  # indices of the chosen columns, shape (b,)
    regrouping: Array  # matrix K with `chi_base = K @ chi_st`, shape (b, p)
    labels: tuple[str, ...]  # names of all p standard parameters

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chosen columns, b strings."""
        return tuple(self.labels[c] for c in self.columns)

    def standard(self, links: Array, drives: Mapping[str, Array] = NO_DRIVES) -> Array:
        """Return the standard parameters of given links and drives, zero for others, shape (p,).

        Links have their `INERTIAL` parameters, shape (n, 10); drives are by name, as `Ia`, shape (n,) each.
        """
        chi = np.zeros(len(self.labels))
        chi[[self.labels.index(f"{name}{j + 1}") for j in range(len(links)) for name in INERTIAL]] = links.ravel()
        for name, values in drives.items():
            chi[[self.labels.index(f"{name}{j + 1}") for j in range(len(values))]] = values
        return chi

    def groups(self) -> dict[str, dict[str, float]]:
        """Return each base parameter as a combination of standard parameters, `{"MX2": {"MX2": 1, "M3": 0.45}}`."""
        return {
            base: {name: float(k) for name, k in zip(self.labels, row, strict=True) if abs(k) > 1e-9}
            for base, row in zip(self.names, self.regrouping, strict=True)
        }


def random_regressor(arm: Arm, rng: np.random.Generator) -> Array:
    """Return the regressor on sufficiently many random states, shape (20 n, n, 14 n)."""
    q, dq, ddq = rng.uniform(-np.pi, np.pi, (3, 20 * arm.n, arm.n))
    return regressor(arm, q, dq, ddq)


def independent_columns(W: Array, tiers: Sequence[Indices], rank_tol: float = RANK_TOL) -> Indices:
    """Return the indices of a maximal independent set of columns of a matrix (r, p), tier by tier, shape (b,).

    Those of earlier tiers are preferred. A unit column with an independent part below `rank_tol` is dependent.
    """
    norms = np.linalg.norm(W, axis=0)
    felt = norms > rank_tol * norms.max(initial=0.0)  # a column of rounding errors is ignored
    unit = np.where(felt, W / np.where(felt, norms, 1.0), 0.0)
    chosen = np.zeros(0, dtype=np.intp)
    Q = np.zeros((len(W), 0))
    for tier in filter(len, tiers):
        new = unit[:, tier] - Q @ (Q.T @ unit[:, tier])
        R, pivots = linalg.qr(new, mode="r", pivoting=True, check_finite=False)
        rank = int(np.sum(np.abs(np.diag(R)) > rank_tol))
        chosen = np.concatenate((chosen, np.asarray(tier)[pivots[:rank]]))
        if tier is not tiers[-1]:
            Q = linalg.qr(unit[:, chosen], mode="economic", check_finite=False)[0]
    return chosen


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """The identifiable structure of an arm."""

    arm: Arm  # the arm, n joints
    base: BaseParameters  # its base parameters, b columns
    joint_columns: tuple[Indices, ...]  # base columns that act on each joint, n index arrays into `base.columns`
    joint_independent: tuple[Indices, ...]  # a maximal subset that is independent in that joint's row, n arrays too
    payload_probes: Array  # the payload's columns of each joint on random states, (n, probes, 10)

    @property
    def first_links(self) -> list[int]:
        """First link with columns of each motor, from 0: the first one that it moves, or its own, with its drive."""
        own, through = np.arange(self.arm.n), self.arm.to_joints
        return (own if through is None else np.minimum(own, np.argmax(through != 0.0, axis=0))).tolist()

    @property
    def payload_columns(self) -> Indices:
        """Indices of the payload's columns, which are those of the last link, shape (10,)."""
        return len(STANDARD) * (self.arm.n - 1) + np.arange(len(INERTIAL))


@lru_cache(maxsize=8)  # some 20 ms
def structure_of(arm: Arm) -> Structure:
    """Return base parameters (paper, eq. 11), friction and offsets included, and the columns that act on each joint."""
    rng, names = np.random.default_rng(PROBE_SEED), labels(arm.n, arm.couplings)
    stacked = random_regressor(arm, rng).reshape(-1, len(names))
    tiers = [np.flatnonzero([name.rstrip("0123456789") in tier for name in names]) for tier in TIERS]
    columns = np.sort(independent_columns(stacked, tiers))
    K = linalg.lstsq(stacked[:, columns], stacked)[0]
    K[np.abs(K) < 1e-10] = 0.0
    W, first = random_regressor(arm, rng), len(STANDARD) * (arm.n - 1)
    rows = [W[:, j, columns] for j in range(arm.n)]
    return Structure(
        arm=arm,
        base=BaseParameters(columns, readonly(K), names),
        joint_columns=tuple(np.flatnonzero(np.abs(row).max(axis=0) > 1e-9) for row in rows),
        joint_independent=tuple(np.sort(independent_columns(row, [np.arange(len(columns))])) for row in rows),
        payload_probes=np.moveaxis(W[..., first : first + len(INERTIAL)], 0, 1),
    )


def structure_from(robot: object) -> Structure:
    """Return the structure of an `Arm` or a Pinocchio model, or the structure itself; raises `RobotModelError`."""
    if type(robot).__module__.startswith("pinocchio"):
        robot = arm_from_pinocchio(cast("pin.Model", robot))
    if not isinstance(robot, Arm | Structure):
        raise RobotModelError(f"the robot is {type(robot).__name__}; expected an Arm (ident.load_arm) or a pin.Model")
    return robot if isinstance(robot, Structure) else structure_of(robot)
