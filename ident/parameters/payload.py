"""The parameters of an unknown payload from all joints together, with fixed gains, and its body.

V_j = h_j (A_j theta + W_L chi_L) + F_j phi_j with given h = 1/g; friction and offset are in drive units and separate
for each motion. Other terms are selected as in `nls`, so that gains have the same meaning as in their identification.
Mass, centre and inertia about it follow with first-order standard deviations.

The paper's own least squares has the torque on the left (section III.A, eq. 23 to 25), all joints stacked, each joint's
rows weighted by its own residual (eq. 22):

    g V = [W_a 0  ] [chi  ]
          [W_b W_L] [chi_L]

Its solution is linear in the gains, so their contribution to the covariance is exact: the derivative of chi_L by g_j is
the solution with left side V on joint j's rows and zero elsewhere.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.intervals import deviations
from ident.estimation.known_gains import KnownGains, Shares
from ident.estimation.problem import Columns, Problem
from ident.estimation.selection import Selected
from ident.model.parameters import INERTIAL, pseudo_inertia
from ident.model.parameters import UNITS as PARAMETER_UNITS
from ident.model.structure import Structure
from ident.numerics.least_squares import least_squares, row_weights
from ident.parameters.arm import Quantity, quantities, shared_shares, with_fixed_gains
from ident.payload.payload import INERTIA_KEYS
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import Contradiction, NotIdentifiable

NEW = 1e-6
"""Least independent part of a unit column of the payload."""
SURE = 3.0
"""Significance of the mass, in standard deviations, required for a centre of mass, and beyond which it is negative."""
STEP = 1e-30
"""Complex step, with which derivatives are exact to rounding."""
CENTRE = ("x", "y", "z")
UNITS = {"mass": "kg", **dict.fromkeys(CENTRE, "m"), **dict.fromkeys(INERTIA_KEYS, "kg m^2")}
"""Quantities of a body, with their units."""
NEEDS = {
    "mass": ("M",),
    **{axis: (f"M{axis.upper()}", "M") for axis in CENTRE},
    **dict.fromkeys(INERTIA_KEYS, INERTIAL),
}
"""Standard parameters that determine each quantity."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundBody:
    """Estimated properties of a body."""

    quantities: tuple[Quantity, ...]  # mass, centre and inertia about the centre, as far as identifiable
    refused: dict[str, str]  # reasons for the others, by name
    possible: bool | None  # whether the ten parameters are physically consistent; None if not all are known

    def of(self, name: str) -> Quantity | None:
        """Return the quantity of that name, None if refused."""
        return next((each for each in self.quantities if each.name == name), None)

    def check_mass(self) -> None:
        """Refuse a significantly negative mass; raises `Contradiction`."""
        mass = self.of("mass")
        if mass is not None and mass.value < -SURE * mass.std:
            raise Contradiction(
                f"the estimated mass is negative: {mass.value:.3g} kg, 2 sigma {2.0 * mass.std:.2g} kg; bare and "
                "loaded recordings are probably swapped, or the signs of gains and currents differ",
                value=mass.value,
                bounds=(-SURE * mass.std, float("inf")),
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class FoundPayload:
    """Parameters of a payload at the origin of the last frame; k of the ten."""

    place: Indices  # indices in `INERTIAL`, shape (k,)
    value: Array  # their values [kg m^2, kg m, kg], shape (k,)
    shares: Shares  # their covariance
    refused: dict[str, str]  # reasons why the others have no value, by name
    selected: Selected

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that have a value, k strings."""
        return tuple(INERTIAL[p] for p in self.place)

    @property
    def parameters(self) -> tuple[Quantity, ...]:
        """The parameters that have a value."""
        return quantities(self.names, [PARAMETER_UNITS[name] for name in self.names], self.value, self.shares)

    @cached_property
    def body(self) -> FoundBody:
        """Mass, centre of mass and inertia with first-order standard deviations."""
        chi, mass = np.zeros(len(INERTIAL)), self.place == INERTIAL.index("M")
        chi[self.place] = self.value
        sure = bool((self.value[mass] > SURE * deviations(self.shares.total)[mass]).any())
        values, J = np.full(len(UNITS), chi[-1]), np.tile(mass.astype(float), (len(UNITS), 1))  # unless it is sure
        if sure:
            steps = chi + 1j * STEP * np.eye(len(chi))[self.place]
            values, J = body_values(chi), np.column_stack([body_values(each).imag / STEP for each in steps])
        refused = dict[str, str]()
        for name in UNITS:
            missing = [need for need in NEEDS[name] if need in self.refused]
            if missing:
                refused[name] = f"{missing[0]}: {self.refused[missing[0]]}"
            elif name != "mass" and not sure:
                refused[name] = f"the mass is less than {SURE:g} standard deviations above zero"
        every = quantities(tuple(UNITS), list(UNITS.values()), values, self.shares.of(J))
        return FoundBody(
            quantities=tuple(each for each in every if each.name not in refused),
            refused=refused,
            possible=None if self.refused else bool(np.linalg.eigvalsh(pseudo_inertia(chi))[0] >= 0.0),
        )


def payload_of(problem: Problem, gains: KnownGains, options: AllJointsOptions) -> FoundPayload:
    """Estimate the parameters of a payload with given gains; a joint without a gain contributes little.

    The problem has bare motions and those of one mounting, with an unknown payload (`known = "none"`). Raises
    `NotIdentifiable` without one of both or if no parameter is identifiable, `GainsError` for gains of another arm.
    """
    problem.check_difference()
    selected = with_fixed_gains(problem, options, gains)
    fit, separate = selected.final, separable(problem.structure)
    at = {int(p): len(fit.ready.shared.arm) + k for k, p in enumerate(fit.ready.shared.free[0])}
    shown: Mask = np.any(fit.of_theta().influence, axis=1)
    place = [p for p, k in at.items() if separate[p] and shown[k]]
    if not place:
        raise NotIdentifiable(
            "no payload parameter is identifiable from these motions; use larger or more varied motions"
        )
    why = ("only its sum with other parameters is identifiable", "these motions do not excite it")
    k = np.array([at[p] for p in place])
    return FoundPayload(
        place=np.array(place, dtype=np.intp),
        value=fit.theta[k],
        shares=shared_shares(selected, gains, k),
        refused={name: why[int(separate[p])] for p, name in enumerate(INERTIAL) if p not in place},
        selected=selected,
    )


def separable(structure: Structure) -> Mask:
    """Return a mask of `INERTIAL` parameters with an independent torque on the arm's joints, shape (10,)."""
    W = np.vstack(list(structure.payload_probes))
    norms = np.linalg.norm(W, axis=0)
    unit, found = W / np.where(norms > 0.0, norms, 1.0), np.zeros(W.shape[1], dtype=bool)
    for p in range(len(found)):
        others = np.delete(unit, p, axis=1)
        found[p] = np.linalg.norm(unit[:, p] - others @ np.linalg.lstsq(others, unit[:, p])[0]) > NEW
    return found


def body_values(chi: Array) -> Array:
    """Return mass, centre, and inertia about it in the order of `INERTIA_KEYS`, shape (10,).

    The standard parameters `chi`, shape (10,), are in the order of `INERTIAL`, real or complex.
    """
    XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = chi
    x, y, z = MX / M, MY / M, MZ / M
    moments = XX - M * (y * y + z * z), YY - M * (x * x + z * z), ZZ - M * (x * x + y * y)
    products = XY + M * x * y, XZ + M * x * z, YZ + M * y * z
    return np.array((M, x, y, z, *moments, *products))


RANK_TOL = 1e-7
"""Smallest relative singular value of columns that the motions determine."""
ESSENTIAL_REL_STD = 0.1
"""Relative standard deviation (eq. 21) below which a parameter is essential, as usual with IDIM-LS."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PaperEstimate:
    """A payload identified as in the paper."""

    parameters: tuple[Quantity, ...]  # the ten parameters, in the order of `INERTIAL`
    gain: Array  # the given gains [N m / drive unit], shape (n,)
    unknowns: int  # number of estimated arm and payload parameters
    error_norm: float  # norm of the weighted residual (table 4 of the paper)
    rel_error_norm: float  # `error_norm` over the norm of the weighted left side
    sigma: float  # standard deviation of the residual (eq. 19)
    system: Columns
    torque: Array  # torques of the fitted model on those rows [N m], shape (r,)

    def __getitem__(self, name: str) -> Quantity:
        """The parameter of that name."""
        return self.parameters[INERTIAL.index(name)]

    @property
    def essential(self) -> tuple[bool, ...]:
        """Whether each parameter has a relative standard deviation below `ESSENTIAL_REL_STD`, of the residual."""
        return tuple(each.residual_std < ESSENTIAL_REL_STD * abs(each.value) for each in self.parameters)


def payload_as_in_paper(system: Columns, gain: Array, gain_std: Array) -> PaperEstimate:
    """Identify arm and payload together with given gains (paper, eq. 25), from rows of unloaded and loaded motions.

    Gains [N m / drive unit] and their standard deviations, zero for gains taken as exact, have the shape (n,). They
    are assumed independent of the rows; for gains identified from the same rows the result is conservative. Raises
    `NotIdentifiable` if the motions do not determine every unknown.
    """
    b, torque = system.W.shape[1], gain[system.joint] * system.V
    W = np.hstack((system.W, system.carried))
    weight = row_weights(W, torque, system.joint)
    fit = least_squares(W * weight[:, None], torque * weight, rank_tol=RANK_TOL)
    by_gain = np.eye(len(gain))[system.joint] * (weight * system.V)[:, None]  # derivative of the left side
    moved = (fit.cofactor @ (W * weight[:, None]).T @ by_gain)[b:] * gain_std  # (10, n)
    error_norm = float(np.linalg.norm(fit.residual))
    stated = Shares(residual=fit.covariance[b:, b:], gains=moved @ moved.T, model=np.zeros((10, 10)))
    return PaperEstimate(
        parameters=quantities(INERTIAL, [PARAMETER_UNITS[name] for name in INERTIAL], fit.x[b:], stated),
        gain=gain,
        unknowns=W.shape[1],
        error_norm=error_norm,
        rel_error_norm=error_norm / float(np.linalg.norm(torque * weight)),
        sigma=fit.sigma,
        system=system,
        torque=W @ fit.x,
    )
