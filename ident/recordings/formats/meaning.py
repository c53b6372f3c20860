"""What a logged v is: a current, a torque computed from it, a torque measured behind the drive, a share of a rating.

Numbers do not tell, and gains mean something else each time, so that it has to be said.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from ident.recordings.formats.units import CURRENT, SHARE, TORQUE


@dataclass(frozen=True, slots=True, kw_only=True)
class Meaning:
    """A kind of v.

    Attributes:
        words: What it is.
        units: Units it may be in, and what one of them is in that of the recording.
        unit: Of v in the recording.
        note: What gains are then, where it is not N m per ampere.
        refused: Why no gain can come of it; empty if one can.
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
            "the weight of the payload, from which gains are identified, is missing in it; log the "
            "motor current or the whole commanded torque, before or with the compensation"
        ),
    ),
}
"""By the name that a description says."""


def kinds() -> str:
    """All of them, for messages."""
    return ", ".join(MEANINGS)
