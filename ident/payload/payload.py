"""Payloads as specified by the user, in the frame of the last link, and their files: TOML with the fields as keys."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ident.model.parameters import INERTIAL
from ident.support.arrays import Array, Mask
from ident.support.errors import PayloadError, placed
from ident.support.files import read_toml
from ident.support.naming import one_line
from ident.support.options import Key, is_number, is_table, one_of, strict_table

INERTIA_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
LIGHTEST, HEAVIEST, FARTHEST = 1e-3, 2000.0, 5.0
"""Plausible masses [kg], and largest distance of the centre of mass [m]."""
WIDE, WIDER = 0.35, 0.15
"""Largest radius of gyration of a payload: 0.35 m + 0.15 m sqrt(mass / kg).

A steel rod of 1 m and 7 kg has 0.29 m, where the limit is 0.75 m; with a moment of inertia that is a thousand times
that of a compact body of this mass, it is 0.85 m.
"""
Known = Literal["all", "com", "mass", "none"]
"""Used parameters of a payload: all, mass and centre of mass, only the mass, or none."""
SHAPES = {"mass": (), "mass_std": (), "com": (3,), "com_std": (3,), "inertia": (6,), "inertia_std": (6,)}
NUMBER = Key("a finite number", is_number)
CENTRE = Key("three numbers [m]", lambda x: isinstance(x, list | tuple) and len(x) == 3 and all(map(is_number, x)))
MOMENTS = Key(f"the keys {', '.join(INERTIA_KEYS)} [kg m^2]", is_table)
KEYS = {
    "mass": NUMBER, "mass_std": NUMBER, "com": CENTRE, "com_std": CENTRE, "inertia": MOMENTS, "inertia_std": MOMENTS,
    "known": one_of(get_args(Known)),
}  # fmt: skip
"""Keys of a payload file."""


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

    @placed("payload")
    def __post_init__(self) -> None:
        """Check the values."""
        for name, shape in SHAPES.items():
            value = getattr(self, name)
            kind = np.asarray(value).dtype.kind if np.shape(value) == shape else ""
            if kind not in tuple("iuf") and not (value is None and name in ("com", "inertia")):
                expected = f"{shape[0]} numbers" if shape else "a number"
                raise PayloadError(f"{name} = {value!r}; expected {expected}")
        if self.known not in get_args(Known):
            raise PayloadError(f"known = {self.known!r}; expected one of {', '.join(get_args(Known))}")
        widest = WIDE + WIDER * max(self.mass, 0.0) ** 0.5
        most = (("mass_std", self.mass), ("com_std", FARTHEST), ("inertia_std", self.mass * FARTHEST**2))
        for name in SHAPES:
            value = getattr(self, name)
            if value is not None and not np.isfinite(value).all():
                raise PayloadError(f"{name} = {value} is not finite")
        if not LIGHTEST <= self.mass <= HEAVIEST:
            raise PayloadError(
                f"mass = {self.mass:g} kg; expected a positive number from {LIGHTEST:g} to {HEAVIEST:g}, in kg"
            )
        if self.com is not None and np.abs(self.com).max() > FARTHEST:
            raise PayloadError(
                f"com = {list(self.com)} is more than {FARTHEST:g} m from the frame's origin; expected metres"
            )
        for name, largest in most:
            if not 0.0 <= np.min(value := getattr(self, name)) <= np.max(value) <= largest:
                raise PayloadError(f"{name} = {value}; expected 0 to {largest:g}; check its unit")
        for name in {"all": ("com", "inertia"), "com": ("com",)}.get(self.known, ()):
            if getattr(self, name) is None:
                raise PayloadError(f"known = {self.known!r} but {name} is missing; add it, or set known = 'mass'")
        if self.inertia is None:
            return
        low, middle, high = np.linalg.eigvalsh(inertia_matrix(self.inertia))
        slack = 1e-9 * max(abs(low), abs(high), 1e-12)
        if low < -slack:
            raise PayloadError(f"inertia is not positive: its smallest principal moment is {low:.3g} kg m^2")
        moment, key = max(zip(self.inertia[:3], INERTIA_KEYS, strict=False))
        if (radius := (moment / self.mass) ** 0.5) > widest:
            raise PayloadError(
                f"inertia.{key} = {moment:g} with mass = {self.mass:g} kg means a radius of gyration of "
                f"{radius:.3g} m; expected {widest:.3g} m at most; state kg m^2 about the centre of mass"
            )
        if high > low + middle + slack:
            raise PayloadError(
                "inertia violates the triangle inequality: principal moments "
                f"{low:.3g} + {middle:.3g} < {high:.3g} kg m^2"
            )

    def known_part(self) -> "KnownPayload":
        """Return the parameters that an estimator may use."""
        names = {"all": INERTIAL, "com": INERTIAL[6:], "mass": INERTIAL[9:], "none": ()}[self.known]
        values = np.array([self.mass, *(self.com or (0.0,) * 3), *(self.inertia or (0.0,) * 6)])
        spread = np.zeros((10, 10))
        for k, std in enumerate((self.mass_std, *self.com_std, *self.inertia_std)):
            # central differences are exact to rounding, as the parameters are polynomials of low degree
            step = 1e-4 * (np.arange(10) == k)
            above, below = (standard_parameters(x[0], x[1:4], x[4:]) for x in (values + step, values - step))
            spread[:, k] = std * (above - below) / 2e-4
        mask = np.array([name in names for name in INERTIAL])
        return KnownPayload(
            names=names, chi=standard_parameters(values[0], values[1:4], values[4:]), spread=spread * mask[:, None]
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownPayload:
    """Known standard parameters of a payload, in the frame of the last link."""

    names: tuple[str, ...]  # names of the known parameters, a subset of `INERTIAL`
    chi: Array  # values in the order of `INERTIAL`, of which only those of `names` are used, shape (10,)
    spread: Array  # factor F of their covariance F F^T, shape (10, k)

    @property
    def mask(self) -> Mask:
        """Mask of known parameters, shape (10,)."""
        return np.array([name in self.names for name in INERTIAL])


def standard_parameters(mass: float, com: Sequence[float] | Array, inertia: Sequence[float] | Array) -> Array:
    """Return the standard parameters of a rigid body at the origin of its frame (Huygens-Steiner), shape (10,).

    They are XX, XY, XZ, YY, YZ, ZZ [kg m^2], MX, MY, MZ [kg m], M [kg], from mass [kg], centre of mass [m], and ixx,
    iyy, izz, ixy, ixz, iyz about the centre of mass [kg m^2].
    """
    c = np.asarray(com, dtype=np.float64)
    J = inertia_matrix(inertia) + mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array([*J[np.triu_indices(3)], *(mass * c), mass])


def inertia_matrix(inertia: Sequence[float] | Array) -> Array:
    """Return the matrix of moments and products in the order of `INERTIA_KEYS`, shape (3, 3)."""
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def read_payload(path: str | Path) -> Payload:
    """Read a payload from a TOML file; raises `PayloadError` if it is missing, not TOML, or not a payload."""
    with placed(one_line(path)):
        return payload_from_table(read_toml(Path(path), error=PayloadError))


@placed("payload")
def payload_from_table(table: Mapping[str, object]) -> Payload:
    """Build a payload from a parsed TOML table, in which products of inertia may be omitted; raises `PayloadError`."""
    values = strict_table(table, KEYS, PayloadError)
    if "mass" not in values:
        raise PayloadError("mass is missing; without it gains and payload are known up to a common factor only")
    for key, value in values.items():
        if (quantity := key.removesuffix("_std")) not in values:
            raise PayloadError(f"{key} is given, but {quantity} is missing")
        if quantity == "inertia":
            given = strict_table(value, dict.fromkeys(INERTIA_KEYS, NUMBER), PayloadError, key)
            for name in INERTIA_KEYS[:3]:
                if name not in given:
                    raise PayloadError(
                        f"{key}.{name} is missing; ixx, iyy and izz are needed, products are 0 if left out"
                    )
            values[key] = tuple(float(given.get(name, 0.0)) for name in INERTIA_KEYS)
        elif quantity != "known":
            values[key] = float(value) if quantity == "mass" else tuple(map(float, value))
    return Payload(**values)


def payload_to_table(payload: Payload) -> dict[str, object]:
    """Return the table of a payload for `payload_from_table`, without unknown values."""
    table: dict[str, object] = {"mass": payload.mass, "mass_std": payload.mass_std}
    if payload.com is not None:
        table |= {"com": list(payload.com), "com_std": list(payload.com_std)}
    if payload.inertia is not None:
        for key, values in (("inertia", payload.inertia), ("inertia_std", payload.inertia_std)):
            table[key] = dict(zip(INERTIA_KEYS, values, strict=True))
    return {**table, "known": payload.known}


def write_payload(payload: Payload, path: str | Path, *, comment: str | None = None) -> None:
    """Write a payload as TOML with all digits, below a comment line."""
    lines = [] if comment is None else [comment]
    for key, value in payload_to_table(payload).items():
        text = f'"{value}"' if isinstance(value, str) else repr(value)
        if isinstance(value, dict):
            text = f"{{ {', '.join(f'{name} = {number!r}' for name, number in value.items())} }}"
        lines.append(f"{key} = {text}")
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
