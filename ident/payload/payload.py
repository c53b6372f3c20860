"""Stated payload, in the frame of the last link."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.model.parameters import INERTIAL
from ident.support.arrays import Array, Mask
from ident.support.errors import PayloadError

INERTIA_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
MOMENTS = INERTIA_KEYS[:3]
LIGHTEST, HEAVIEST, FARTHEST = 1e-3, 2000.0, 5.0
"""Plausible masses [kg], and largest distance of the centre of mass or radius of gyration [m]."""
Known = Literal["all", "com", "mass", "none"]
"""Used parameters of a payload: all, mass and centre of mass, only the mass, or none."""


@dataclass(frozen=True, slots=True)
class Payload:
    """Stated parameters of a payload. Checked at creation.

    Attributes:
        mass: Mass [kg].
        mass_std: Standard deviation of the mass [kg].
        com: Centre of mass in the frame of the last link [m], None if unknown.
        com_std: Standard deviation of the centre of mass, per axis [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, axes of the last link [kg m^2], None if unknown.
        inertia_std: Standard deviations of the inertia [kg m^2].
        known: Parameters to use: "all", "com" (mass and centre of mass), "mass" or "none".

    Raises:
        PayloadError: If a value is missing for `known`, not finite, or physically impossible.
    """

    mass: float
    mass_std: float = 0.0
    com: tuple[float, float, float] | None = None
    com_std: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: tuple[float, float, float, float, float, float] | None = None
    inertia_std: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    known: Known = "all"

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("mass", "mass_std", "com", "com_std", "inertia", "inertia_std"):
            value = getattr(self, name)
            if value is not None and not np.isfinite(value).all():
                raise PayloadError(f"payload: {name} = {value} is not finite")
        if not LIGHTEST <= self.mass <= HEAVIEST:
            raise PayloadError(
                f"payload: mass = {self.mass:g} kg; expected a positive number from {LIGHTEST:g} to {HEAVIEST:g}, in kg"
            )
        if self.com is not None and max(abs(c) for c in self.com) > FARTHEST:
            raise PayloadError(
                f"payload: com = {list(self.com)} is more than {FARTHEST:g} m from the frame's origin; expected metres"
            )
        self._check_deviations()
        needed = {"all": ("com", "inertia"), "com": ("com",)}.get(self.known, ())
        missing = next((name for name in needed if getattr(self, name) is None), None)
        if missing is not None:
            raise PayloadError(
                f"payload: known = {self.known!r} but {missing} is missing; add it, or set known = 'mass'"
            )
        if self.inertia is not None:
            self._check_size(self.inertia)
            check_inertia(self.inertia)

    def _check_deviations(self) -> None:
        """Check that standard deviations are not negative and not implausibly large."""
        largest = {"mass_std": self.mass, "com_std": FARTHEST, "inertia_std": self.mass * FARTHEST**2}
        for name, most in largest.items():
            value = getattr(self, name)
            values = (value,) if name == "mass_std" else value
            if min(values) < 0.0:
                raise PayloadError(f"payload: {name} = {value}: expected a standard deviation of 0 or more")
            if max(values) > most:
                what = "the mass itself" if name == "mass_std" else f"{most:g}"
                raise PayloadError(f"payload: {name} = {value} exceeds {what}; check its unit")

    def _check_size(self, inertia: tuple[float, ...]) -> None:
        """Check that the body can be within `FARTHEST` of its centre of mass."""
        name, value = max(zip(INERTIA_KEYS, inertia, strict=True), key=lambda pair: abs(pair[1]))
        if abs(value) > self.mass * FARTHEST**2:
            raise PayloadError(
                f"payload: inertia.{name} = {value:g} needs parts of the {self.mass:g} kg more "
                f"than {FARTHEST:g} m from the centre of mass; expected kg m^2 about the centre of mass"
            )

    def known_part(self) -> "KnownPayload":
        """Return the parameters that an estimator may use."""
        names = {"all": INERTIAL, "com": INERTIAL[6:], "mass": INERTIAL[9:], "none": ()}[self.known]
        chi = standard_parameters(self.mass, self.com or (0.0,) * 3, self.inertia or (0.0,) * 6)
        return KnownPayload(names=names, chi=chi, spread=self._spread())

    def _spread(self) -> Array:
        """Factor F of the covariance F F^T of the known parameters, from specified standard deviations, (10, 10)."""
        if self.known == "none":
            return np.zeros((10, 10))
        if self.known == "mass":
            return np.diag([0.0] * 9 + [self.mass_std])
        values = np.array([self.mass, *(self.com or (0.0,) * 3), *(self.inertia or (0.0,) * 6)])
        std = np.array([self.mass_std, *self.com_std, *self.inertia_std])
        if self.known == "com":
            std[4:] = 0.0
        J = np.empty((10, 10))
        for k in range(
            10
        ):  # central differences are exact to rounding, as the parameters are polynomials of low degree
            step = np.zeros(10)
            step[k] = 1e-4
            above, below = (standard_parameters(x[0], x[1:4], x[4:]) for x in (values + step, values - step))
            J[:, k] = (above - below) / 2e-4
        if self.known == "com":
            J[:6] = 0.0
        return J * std


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPayload:
    """Known standard parameters of a payload, in the frame of the last link.

    Attributes:
        names: Names of the known parameters, a subset of `INERTIAL`.
        chi: Values in the order of `INERTIAL`, of which only those of `names` are used, shape (10,).
        spread: Factor F of their covariance F F^T, shape (10, k).
    """

    names: tuple[str, ...]
    chi: Array
    spread: Array

    @property
    def mask(self) -> Mask:
        """Mask of known parameters, shape (10,)."""
        return np.array([name in self.names for name in INERTIAL])


def standard_parameters(mass: float, com: Sequence[float] | Array, inertia: Sequence[float] | Array) -> Array:
    """Return the standard parameters of a rigid body at the origin of its frame (Huygens-Steiner).

    Args:
        mass: Mass [kg].
        com: Centre of mass [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass [kg m^2].

    Returns:
        XX, XY, XZ, YY, YZ, ZZ [kg m^2], MX, MY, MZ [kg m], M [kg], shape (10,).
    """
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    c = np.asarray(com, dtype=np.float64)
    J = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([*J[np.triu_indices(3)], *(mass * c), mass])


def check_inertia(inertia: tuple[float, ...]) -> None:
    """Refuse a physically impossible inertia about the centre of mass.

    Raises:
        PayloadError: If it is impossible; the message names the violated condition.
    """
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    moments = np.linalg.eigvalsh(np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]))
    slack = 1e-9 * max(abs(moments).max(), 1e-12)
    if moments[0] < -slack:
        raise PayloadError(
            f"payload: inertia is not positive: its smallest principal moment is {moments[0]:.3g} kg m^2"
        )
    if moments[2] > moments[0] + moments[1] + slack:
        raise PayloadError(
            "payload: inertia violates the triangle inequality: principal moments "
            f"{moments[0]:.3g} + {moments[1]:.3g} < {moments[2]:.3g} kg m^2"
        )
