"""What the columns of a foreign log mean: units, signs and zeros, and the quantity of v.

The quantity of v (a current, a torque before or after the drive, a share of a rating) cannot be inferred from its
values but determines the meaning of gains, so it must be declared.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace

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


@dataclass(frozen=True, slots=True)
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
    "current": Meaning("motor current, measured or commanded", CURRENT, "A"),
    TORQUE_FROM_CURRENT: Meaning(
        "the controller's torque: current times its constant", TORQUE, "N m",
        "v is a torque computed by the controller: a gain is the correction factor of its torque constant",
    ),
    "torque-after-drive": Meaning(
        "torque measured behind gear and friction", TORQUE, "N m",
        "v is measured after the drive: a gain is the scale of the torque sensor, not of the drive",
    ),
    "percent": Meaning(
        "share of a rated current or torque", SHARE, "%", "v is a share of a rating: a gain is N m per percent"
    ),
    "gravity-compensated": Meaning(
        "current or torque after gravity compensation", CURRENT | TORQUE | SHARE, "",
        refused="it lacks the weight of the payload, from which gains are identified; log the motor current, or the "
        "whole commanded torque including the compensation",
    ),
}  # fmt: skip
"""Quantities by their names in a description."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLayout:
    """Layout of a text file; None for values to be detected.

    Attributes:
        separator: Separator of columns, one character.
        decimal: Decimal sign, `.` or `,`.
        header: Line of the column names, from 1; 0 without a header, then columns are named 1, 2, ...
        rows: Line of the first row, from 1.
        encoding: Encoding, as named in Python.
    """

    separator: str | None = None
    decimal: str | None = None
    header: int | None = None
    rows: int | None = None
    encoding: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """Description of time, positions or currents; empty if not declared. One entry for all joints, or one each.

    Attributes:
        columns: Names of the columns by joint; `{joint}` is replaced by the joint's name.
        unit: Units.
        counts_per_turn: Encoder counts per turn of the joint, for positions in ticks.
        sign: 1 or -1.
        zero: Offset added to a position after its sign, in the log's unit: the position at a logged 0.
        constant: Torque constant with which the controller multiplied the current [N m/A]; None if not declared, empty
            if declared unknown.
    """

    columns: tuple[str, ...] = ()
    unit: tuple[str, ...] = ()
    counts_per_turn: tuple[float, ...] = ()
    sign: tuple[float, ...] = ()
    zero: tuple[float, ...] = ()
    constant: tuple[float, ...] | None = None

    def over(self, known: "Channels") -> "Channels":
        """Return these completed by those of a layout, unless columns are declared."""
        if self.columns:
            return self
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        return replace(known, **{name: value for name, value in own.items() if value != getattr(NOTHING, name)})


NOTHING = Channels()


@dataclass(frozen=True, slots=True, kw_only=True)
class LogDescription:
    """Description of a log; missing parts are taken from its layout.

    Attributes:
        signal: Quantity of v, a name of `MEANINGS`.
        layout: A name of `LAYOUTS`; recognised by the columns if not declared.
        joints: Names of the joints, base to flange, if the log has joints by name.
        topic: Topic of a bag.
        only: Columns and the values that select rows.
        t: Description of time.
        q: Description of positions.
        v: Description of currents.
        text: Layout of a text file.
    """

    signal: str | None = None
    layout: str | None = None
    joints: tuple[str, ...] | None = None
    topic: str | None = None
    only: tuple[tuple[str, float], ...] = ()
    t: Channels = NOTHING
    q: Channels = NOTHING
    v: Channels = NOTHING
    text: TextLayout = field(default_factory=TextLayout)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, each once."""
        of_rows = (name for name, _ in self.only)
        return tuple(dict.fromkeys((*self.t.columns, *self.q.columns, *self.v.columns, *of_rows)))

    @property
    def dated(self) -> frozenset[str]:
        """Names of the columns with dates."""
        return frozenset(self.t.columns if self.t.unit == (ISO,) else ())
