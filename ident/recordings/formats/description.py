"""Description of a foreign log: its columns, their units, signs and zeros, and the quantity of v."""

from dataclasses import dataclass, field, fields, replace


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
    t: Channels = Channels()
    q: Channels = Channels()
    v: Channels = Channels()
    text: TextLayout = field(default_factory=TextLayout)


NOTHING = Channels()
"""The empty description."""


def over(given: Channels, known: Channels) -> Channels:
    """Return the description completed by a layout, except for parts with declared columns."""
    if given.columns:
        return given
    own = {each.name: getattr(given, each.name) for each in fields(given)}
    return replace(known, **{name: value for name, value in own.items() if value != getattr(NOTHING, name)})
