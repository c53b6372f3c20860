"""The parameters of an unknown payload from all joints together, with fixed gains (paper, eq. 25).

V_j = h_j (A_j theta + W_L chi_L) + F_j phi_j with given h = 1/g; friction and offset are in drive units and separate
for each motion. Other terms are selected as in `nls`, so that gains have the same meaning as in their identification.
Their uncertainty is propagated to first order: d chi_L / d log h is the influence of a row of the prior on log h.
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.selection import Selected
from ident.estimation.all_joints.solution import Setting
from ident.estimation.estimators.nls import AllJointsOptions, chosen_model, setting_of
from ident.estimation.fixed_gains import gain_covariance, held, own_beliefs
from ident.estimation.known_gains import KnownGains
from ident.estimation.problem import Problem
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.model.parameters import INERTIAL
from ident.model.structure import Structure
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

NEW = 1e-6
"""Least independent part of a unit column of the payload."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundPayload:
    """Parameters of a payload at the origin of the last frame; k of the ten.

    Attributes:
        place: Indices in `INERTIAL`, shape (k,).
        value: Their values [kg m^2, kg m, kg], shape (k,).
        residual: Covariance from the residuals, shape (k, k).
        gains: Covariance from the gains, shape (k, k).
        model: Covariance from the model's assumptions, shape (k, k).
        refused: Reasons why the others have no value, by name.
        ready: The solved problem.
        selected: The model, and its fit.
    """

    place: Indices
    value: Array
    residual: Array
    gains: Array
    model: Array
    refused: dict[str, str]
    ready: Setting
    selected: Selected

    @property
    def covariance(self) -> Array:
        """Total covariance of the values, shape (k, k)."""
        return self.residual + self.gains + self.model

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that have a value, k strings."""
        return tuple(INERTIAL[p] for p in self.place)

    def at(self, name: str) -> int:
        """Return the index of a parameter among those that have a value.

        Raises:
            NotIdentifiable: If it has none; the message says why.
        """
        if name in self.refused:
            raise NotIdentifiable(f"the payload's {name}: {self.refused[name]}")
        return self.names.index(name)


def payload_of(problem: Problem, gains: KnownGains, options: AllJointsOptions) -> FoundPayload:
    """Estimate the parameters of a payload with given gains.

    Args:
        problem: Bare motions and those of one mounting, with an unknown payload (`known = "none"`).
        gains: Gains of all or some joints; a joint without a gain contributes little.
        options: Options of the model, as in the identification of the gains.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or no parameter of the payload is identifiable.
        GainsError: If the gains are not of this arm.
    """
    problem.check_difference()
    gains.check_arm(problem.structure.arm)
    ready = setting_of(problem, options, held(gains))
    selected = chosen_model(ready, options)
    final, first = selected.final, len(ready.shared.arm)
    separate = separable(problem.structure)
    place, at, refused = list[int](), list[int](), dict[str, str]()
    for k, p in enumerate(ready.shared.free[0].tolist()):
        if separate[p] and final.fit.theta_influence[first + k].any():
            place.append(p)
            at.append(first + k)
    for p, name in enumerate(INERTIAL):
        if p not in place:
            alone = (
                "these motions do not excite it"
                if separate[p]
                else "only its sum with other parameters is identifiable"
            )
            refused[name] = alone
    if not place:
        raise NotIdentifiable(
            "no payload parameter is identifiable from these motions; use larger or more varied motions"
        )
    belief = final.fit.theta_belief[at]
    rivals = [
        each.share * (each.other.fit.found.theta[at] - each.final.fit.found.theta[at]) for each in selected.rivals
    ]
    model = np.column_stack([own_beliefs(belief, gains), *rivals])
    rows, uncertainty = final.fit.rows, UNCERTAINTIES[problem.options.uncertainty]
    return FoundPayload(
        place=np.array(place, dtype=np.intp),
        value=final.fit.found.theta[at],
        residual=uncertainty(rows, final.fit.theta_influence[at]),
        gains=gain_covariance(belief, gains),
        model=model @ model.T,
        refused=refused,
        ready=ready,
        selected=selected,
    )


def separable(structure: Structure) -> Array:
    """Return a mask of `INERTIAL` parameters with an independent torque on the arm's joints, shape (10,)."""
    W = np.vstack(list(structure.payload_probes))
    norms = np.linalg.norm(W, axis=0)
    unit = W / np.where(norms > 0.0, norms, 1.0)
    found = np.zeros(unit.shape[1], dtype=bool)
    for p in range(len(found)):
        others = np.delete(unit, p, axis=1)
        left = unit[:, p] - others @ np.linalg.lstsq(others, unit[:, p])[0]
        found[p] = np.linalg.norm(left) > NEW
    return found
