"""Units of logs, and quantities of v: a current, a torque before or after the drive, a share of a rating.

The quantity of v cannot be inferred from its values but determines the meaning of gains, so it must be declared.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

ISO = "iso"
"""Time as dates, 2031-07-19T09:41:07.125."""
TICKS = "ticks"
"""Positions as encoder counts, with separately declared counts per turn."""
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, ISO: 1.0}
"""Seconds."""
POSITION = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi, "m": 1.0, "mm": 1e-3, TICKS: 2.0 * math.pi}
"""Radians or metres; for ticks, a turn."""
CURRENT = {"A": 1.0, "mA": 1e-3}
"""Amperes."""
SHARE = {"%": 1.0, "per mille": 0.1}
"""Percent."""
TORQUE = {"N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "N": 1.0}
"""Newton metres, newtons for prismatic joints."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Meaning:
    """A quantity of v.

    Attributes:
        words: Description.
        units: Allowed units, with their factors to the unit of the recording.
        unit: Unit of v in the recording.
        note: Meaning of gains, if not N m per ampere.
        refused: Why no gain is identifiable from it, or empty.
    """

    words: str
    units: Mapping[str, float]
    unit: str
    note: str = ""
    refused: str = ""


TORQUE_FROM_CURRENT = "torque-from-current"
MEANINGS: dict[str, Meaning] = {
    "current": Meaning(words="motor current, measured or commanded", units=CURRENT, unit="A"),
    TORQUE_FROM_CURRENT: Meaning(
        words="the controller's torque: current times its constant",
        units=TORQUE,
        unit="N m",
        note="v is a torque computed by the controller: a gain is the correction factor of its torque constant",
    ),
    "torque-after-drive": Meaning(
        words="torque measured behind gear and friction",
        units=TORQUE,
        unit="N m",
        note="v is measured after the drive: a gain is the scale of the torque sensor, not of the drive",
    ),
    "percent": Meaning(
        words="share of a rated current or torque",
        units=SHARE,
        unit="%",
        note="v is a share of a rating: a gain is N m per percent",
    ),
    "gravity-compensated": Meaning(
        words="current or torque after gravity compensation",
        units=CURRENT | TORQUE | SHARE,
        unit="",
        refused=(
            "it lacks the weight of the payload, from which gains are identified; log the "
            "motor current, or the whole commanded torque including the compensation"
        ),
    ),
}
"""Quantities by their names in a description."""
