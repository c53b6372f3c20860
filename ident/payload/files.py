"""Payload descriptions in TOML: the keys are the fields of `Payload`, inertia is a table."""

from collections.abc import Mapping
from pathlib import Path
from typing import cast, get_args

from ident.payload.payload import INERTIA_KEYS, MOMENTS, Known, Payload
from ident.support.errors import PayloadError
from ident.support.naming import nearest, one_line, shown
from ident.support.toml_files import read_toml

KEYS = ("mass", "mass_std", "com", "com_std", "inertia", "inertia_std", "known")
WIDE, WIDER = 0.35, 0.15
"""Largest radius of gyration of a payload: 0.35 m + 0.15 m sqrt(mass / kg).

A steel rod of 1 m and 7 kg has 0.29 m, where the limit is 0.75 m; with a moment of inertia that is a thousand times
that of a compact body of this mass, it is 0.85 m.
"""


def read_payload(path: str | Path) -> Payload:
    """Read a payload from a TOML file.

    Raises:
        PayloadError: If the file is missing or not TOML, has an unknown key or a wrong type, or fails the checks of
            `Payload`.
    """
    path = Path(path)
    table = read_toml(path, error=PayloadError)
    try:
        return payload_from_table(table)
    except PayloadError as error:
        raise PayloadError(f"{one_line(path)}: {error}") from error


def payload_from_table(table: Mapping[str, object]) -> Payload:
    """Build a payload from a parsed TOML table.

    Omitted products of inertia (and their standard deviations) are 0.

    Raises:
        PayloadError: As `read_payload`.
    """
    for key in table:
        if key not in KEYS:
            raise PayloadError(f"payload: unknown key {shown(key)}{nearest(key, KEYS)}; expected {', '.join(KEYS)}")
    if "mass" not in table:
        raise PayloadError(
            "payload: mass is missing; without it gains and payload are known up to a common factor only"
        )
    for key in ("com", "inertia"):
        if f"{key}_std" in table and key not in table:
            raise PayloadError(f"payload: {key}_std is given, but {key} is missing")
    com, com_std = _vector(table, "com"), _vector(table, "com_std")
    inertia, inertia_std = _inertia(table, "inertia"), _inertia(table, "inertia_std")
    payload = Payload(
        mass=_number(table["mass"], "mass"),
        mass_std=_number(table.get("mass_std", 0.0), "mass_std"),
        com=com,
        com_std=com_std or (0.0, 0.0, 0.0),
        inertia=inertia,
        inertia_std=inertia_std or (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        known=_known(table.get("known", "all")),
    )
    _check_gyration(payload)
    return payload


def _check_gyration(payload: Payload) -> None:
    """Refuse an inertia that is implausibly large for the mass, probably in another unit.

    Raises:
        PayloadError: If the radius of gyration exceeds `WIDE` + `WIDER` sqrt(mass).
    """
    if payload.inertia is None:
        return
    key, moment = max(zip(MOMENTS, payload.inertia, strict=False), key=lambda pair: pair[1])
    radius, most = (moment / payload.mass) ** 0.5, WIDE + WIDER * payload.mass**0.5
    if radius > most:
        raise PayloadError(
            f"payload: inertia.{key} = {moment:g} with mass = {payload.mass:g} kg means a radius of gyration of "
            f"{radius:.3g} m; expected {most:.3g} m at most; state kg m^2 about the centre of mass"
        )


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
        if isinstance(value, dict):
            entries = ", ".join(f"{name} = {number!r}" for name, number in value.items())
            lines.append(f"{key} = {{ {entries} }}")
        else:
            lines.append(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value!r}")
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _known(value: object) -> Known:
    if value in get_args(Known):
        return cast("Known", value)
    raise PayloadError(f"payload: known = {shown(value)}; expected 'all', 'com', 'mass' or 'none'")


def _number(value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PayloadError(f"payload: {name} = {shown(value)} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise PayloadError(f"payload: {name} is too large a number") from None


def _vector(table: Mapping[str, object], key: str) -> tuple[float, float, float] | None:
    value = table.get(key)
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise PayloadError(f"payload: {key} = {shown(value)}; expected three numbers [m]")
    x, y, z = (_number(item, key) for item in value)
    return x, y, z


def _inertia(table: Mapping[str, object], key: str) -> tuple[float, float, float, float, float, float] | None:
    value = table.get(key)
    if value is None:
        return None
    if not isinstance(value, Mapping):
        raise PayloadError(f"payload: {key} = {shown(value)}; expected the keys {', '.join(INERTIA_KEYS)} [kg m^2]")
    for name in value:
        if name not in INERTIA_KEYS:
            close = nearest(str(name), INERTIA_KEYS)
            raise PayloadError(
                f"payload: unknown key {key}.{one_line(name)}{close}; expected {', '.join(INERTIA_KEYS)}"
            )
    for name in MOMENTS:
        if name not in value:
            raise PayloadError(
                f"payload: {key}.{name} is missing; ixx, iyy and izz are needed, products are 0 if left out"
            )
    ixx, iyy, izz, ixy, ixz, iyz = (_number(value.get(name, 0.0), f"{key}.{name}") for name in INERTIA_KEYS)
    return ixx, iyy, izz, ixy, ixz, iyz
