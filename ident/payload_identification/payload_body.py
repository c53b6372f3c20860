"""Mass, centre of mass and inertia of a payload from its standard parameters, with standard deviations."""

from dataclasses import dataclass

import numpy as np

from ident.model.parameters import INERTIAL, pseudo_inertia
from ident.payload.payload import INERTIA_KEYS
from ident.payload_identification.payload_estimate import FoundPayload
from ident.support.arrays import Array

SURE = 3.0
"""Significance of the mass, in standard deviations, required for a centre of mass."""
STEP = 1e-30
"""Complex step, with which derivatives are exact to rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A number with its standard deviations.

    Attributes:
        name: Name of the quantity.
        unit: Its unit.
        value: Estimate.
        residual_std: Standard deviation from the residuals.
        gain_std: Standard deviation from the gains.
        model_std: Standard deviation from the model's assumptions.
    """

    name: str
    unit: str
    value: float
    residual_std: float
    gain_std: float
    model_std: float

    @property
    def std(self) -> float:
        """Total standard deviation."""
        return float(np.linalg.norm((self.residual_std, self.gain_std, self.model_std)))


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundBody:
    """Estimated properties of a body.

    Attributes:
        quantities: Mass, centre and inertia about the centre, as far as identifiable.
        refused: Reasons for the others, by name.
        possible: Whether the ten parameters are physically consistent; None if not all are known.
    """

    quantities: tuple[Quantity, ...]
    refused: dict[str, str]
    possible: bool | None

    def of(self, name: str) -> Quantity | None:
        """Return the quantity of that name, None if refused."""
        return next((each for each in self.quantities if each.name == name), None)


CENTRE = ("x", "y", "z")
UNITS = {"mass": "kg", **dict.fromkeys(CENTRE, "m"), **dict.fromkeys(INERTIA_KEYS, "kg m^2")}
NEEDS = {
    "mass": ("M",),
    **{axis: (f"M{axis.upper()}", "M") for axis in CENTRE},
    **dict.fromkeys(INERTIA_KEYS, INERTIAL),
}
"""Standard parameters that determine each quantity."""


def body_of(found: FoundPayload) -> FoundBody:
    """Return mass, centre of mass and inertia with first-order standard deviations."""
    chi = np.zeros(len(INERTIAL))
    chi[found.place] = found.value
    refused = dict[str, str]()
    sure = "M" in found.names and chi[9] > SURE * np.sqrt(found.covariance[found.at("M"), found.at("M")])
    quantities = list[Quantity]()
    J = _jacobian(chi)[:, found.place] if sure else np.zeros((len(UNITS), len(found.place)))
    if "M" in found.names:
        J[0] = found.place == INERTIAL.index("M")
    values = body_values(chi) if sure else chi[[9] * len(UNITS)]
    shares = [_std(J, part) for part in (found.residual, found.gains, found.model)]
    for k, (name, unit) in enumerate(UNITS.items()):
        missing = [need for need in NEEDS[name] if need in found.refused]
        if missing:
            refused[name] = f"{missing[0]}: {found.refused[missing[0]]}"
        elif name != "mass" and not sure:
            refused[name] = f"the mass is less than {SURE:g} standard deviations above zero"
        else:
            residual, gain, model = (float(share[k]) for share in shares)
            quantities.append(
                Quantity(
                    name=name,
                    unit=unit,
                    value=float(values[k]),
                    residual_std=residual,
                    gain_std=gain,
                    model_std=model,
                )
            )
    possible = None if found.refused else bool(np.linalg.eigvalsh(pseudo_inertia(chi))[0] >= 0.0)
    return FoundBody(quantities=tuple(quantities), refused=refused, possible=possible)


def body_values(chi: Array) -> Array:
    """Return mass, centre, and inertia about it in the order of `INERTIA_KEYS`, shape (10,).

    Args:
        chi: Standard parameters in the order of `INERTIAL`, real or complex, shape (10,).
    """
    XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = chi
    x, y, z = MX / M, MY / M, MZ / M
    moments = XX - M * (y * y + z * z), YY - M * (x * x + z * z), ZZ - M * (x * x + y * y)
    products = XY + M * x * y, XZ + M * x * z, YZ + M * y * z
    return np.array((M, x, y, z, *moments, *products))


def _std(J: Array, covariance: Array) -> Array:
    """Return the standard deviations of J x for a covariance of x; negative variances due to rounding are 0."""
    return np.sqrt(np.maximum(np.einsum("ik,kl,il->i", J, covariance, J), 0.0))


def _jacobian(chi: Array) -> Array:
    """Return the derivative of `body_values`, shape (10, 10)."""
    steps = 1j * STEP * np.eye(len(chi))
    return np.column_stack([body_values(chi + step).imag / STEP for step in steps])
