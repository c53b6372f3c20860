"""The parameters of an unknown payload from all joints at once, the gains held (paper, eq. 25).

V_j = h_j (A_j theta + W_L chi_L) + F_j phi_j with h = 1/g given: friction and offset in drive units, of each motion its
own, and whatever else `nls` lets data choose, so that gains mean the same here as where they were found. What their
uncertainty adds is exact to first order: d chi_L / d log h is what a row of the prior on log h does to chi_L.
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
"""Part of a unit column of the payload that no other column of it may imitate."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundPayload:
    """Parameters of a payload at the origin of the last frame; k of the ten.

    Attributes:
        place: Which of `INERTIAL`, shape (k,).
        value: Their values [kg m^2, kg m, kg], shape (k,).
        residual: Covariance from the residuals, shape (k, k).
        gains: Covariance from that of the gains, shape (k, k).
        model: Covariance from what the model takes for granted, shape (k, k).
        refused: Why the others have no value, by name.
        ready: The problem that was solved.
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
        """Of the values, all shares together, shape (k, k)."""
        return self.residual + self.gains + self.model

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that have a value, k strings."""
        return tuple(INERTIAL[p] for p in self.place)

    def at(self, name: str) -> int:
        """Where a parameter is among those that have a value.

        Raises:
            NotIdentifiable: If it has none; the message says why.
        """
        if name in self.refused:
            raise NotIdentifiable(f"the payload's {name}: {self.refused[name]}")
        return self.names.index(name)


def payload_of(problem: Problem, gains: KnownGains, options: AllJointsOptions) -> FoundPayload:
    """Find the parameters of a payload with the gains in use.

    Args:
        problem: Bare motions and those of one mounting, of whose payload nothing is known (`known = "none"`).
        gains: Gains of the arm's joints, of all or some; a joint without one adds little.
        options: Model of the arm, as it was where the gains were found.

    Raises:
        NotIdentifiable: If no motion is bare or none is loaded, or nothing of the payload shows.
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
        raise NotIdentifiable("no payload parameter is identifiable from these motions; move it more, or further")
    belief = final.fit.theta_belief[at]
    rivals = [
        each.share * (each.other.fit.found.theta[at] - each.final.fit.found.theta[at]) for each in selected.rivals
    ]
    model = np.column_stack([own_beliefs(belief, gains), *rivals])
    rows, uncertainty = final.fit.rows, UNCERTAINTIES[problem.options.uncertainty]
    return FoundPayload(
        place=np.array(place, dtype=np.intp),
        value=final.fit.found.theta[at],
        residual=uncertainty(rows, final.fit.theta_influence[at], problem.options.serial_s),
        gains=gain_covariance(belief, gains),
        model=model @ model.T,
        refused=refused,
        ready=ready,
        selected=selected,
    )


def separable(structure: Structure) -> Array:
    """Which of `INERTIAL` put a torque on the arm's joints that no others imitate, shape (10,) of truth values."""
    W = np.vstack(list(structure.payload_probes))
    norms = np.linalg.norm(W, axis=0)
    unit = W / np.where(norms > 0.0, norms, 1.0)
    found = np.zeros(unit.shape[1], dtype=bool)
    for p in range(len(found)):
        others = np.delete(unit, p, axis=1)
        left = unit[:, p] - others @ np.linalg.lstsq(others, unit[:, p])[0]
        found[p] = np.linalg.norm(left) > NEW
    return found
