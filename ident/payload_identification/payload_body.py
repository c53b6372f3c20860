"""Mass, centre of mass and inertia of a payload from its standard parameters, with deviations."""

from dataclasses import dataclass

import numpy as np

from ident.model.parameters import INERTIAL, pseudo_inertia
from ident.payload.payload import INERTIA_KEYS
from ident.payload_identification.payload_estimate import FoundPayload
from ident.support.arrays import Array

SURE = 3.0
"""Deviations that a mass must be from zero for a centre of mass to be taken from it."""
STEP = 1e-30
"""Step into the imaginary, by which derivatives are exact to rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A number with its deviations.

    Attributes:
        name: What.
        unit: Its unit.
        value: Estimate.
        residual_std: Standard deviation from the residuals.
        gain_std: From the gains.
        model_std: From what the model takes for granted.
    """

    name: str
    unit: str
    value: float
    residual_std: float
    gain_std: float
    model_std: float

    @property
    def std(self) -> float:
        """Standard deviation, all shares together."""
        return float(np.linalg.norm((self.residual_std, self.gain_std, self.model_std)))


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundBody:
    """What was found of a body.

    Attributes:
        quantities: Mass, centre and inertia about it, as many as can be given.
        refused: Why the others cannot, by name.
        possible: Whether a body can have all ten parameters; None where not all are known.
    """

    quantities: tuple[Quantity, ...]
    refused: dict[str, str]
    possible: bool | None

    def of(self, name: str) -> Quantity | None:
        """The quantity of that name, None if it is refused."""
        return next((each for each in self.quantities if each.name == name), None)


CENTRE = ("x", "y", "z")
UNITS = {"mass": "kg", **dict.fromkeys(CENTRE, "m"), **dict.fromkeys(INERTIA_KEYS, "kg m^2")}
NEEDS = {
    "mass": ("M",),
    **{axis: (f"M{axis.upper()}", "M") for axis in CENTRE},
    **dict.fromkeys(INERTIA_KEYS, INERTIAL),
}
"""Standard parameters that each quantity follows from."""


def body_of(found: FoundPayload) -> FoundBody:
    """Mass, centre of mass and inertia, each with its deviations to first order."""
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
    """Mass, centre, and inertia about it in the order of `INERTIA_KEYS`, shape (10,); inverse of Huygens-Steiner.

    Args:
        chi: Standard parameters in the order of `INERTIAL`, real or complex, shape (10,).
    """
    XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = chi
    x, y, z = MX / M, MY / M, MZ / M
    moments = XX - M * (y * y + z * z), YY - M * (x * x + z * z), ZZ - M * (x * x + y * y)
    products = XY + M * x * y, XZ + M * x * z, YZ + M * y * z
    return np.array((M, x, y, z, *moments, *products))


def _std(J: Array, covariance: Array) -> Array:
    """Deviations of J x where x has the covariance; a variance that rounding made negative is none."""
    return np.sqrt(np.maximum(np.einsum("ik,kl,il->i", J, covariance, J), 0.0))


def _jacobian(chi: Array) -> Array:
    """Derivative of `body_values`, shape (10, 10)."""
    steps = 1j * STEP * np.eye(len(chi))
    return np.column_stack([body_values(chi + step).imag / STEP for step in steps])
