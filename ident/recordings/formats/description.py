"""What a user says of a foreign log: its columns, their units, signs and zeros, and what v is."""

from dataclasses import dataclass, field, fields, replace


@dataclass(frozen=True, slots=True, kw_only=True)
class TextLayout:
    """A text file's layout; None for what is to be found out.

    Attributes:
        separator: Between columns, one character.
        decimal: Decimal sign, `.` or `,`.
        header: Line of the column names, from 1; 0 if there is none and columns are called 1, 2, ...
        rows: Line of the first row, from 1.
        encoding: Of the characters, as Python names it.
    """

    separator: str | None = None
    decimal: str | None = None
    header: int | None = None
    rows: int | None = None
    encoding: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """What is said of time, of positions or of currents; empty for what is not. One entry for all joints, or one each.

    Attributes:
        columns: Names of the columns, joint after joint; `{joint}` stands for the joint's name.
        unit: Units.
        counts_per_turn: Counts of the encoder in one turn of the joint, of positions in ticks.
        sign: 1 or -1.
        zero: Added to a position after its sign, in the log's unit: where the arm is when the log says 0.
        constant: Newton metres per ampere that the controller multiplied the current by; None if not said, empty if
            said to be unknown.
    """

    columns: tuple[str, ...] = ()
    unit: tuple[str, ...] = ()
    counts_per_turn: tuple[float, ...] = ()
    sign: tuple[float, ...] = ()
    zero: tuple[float, ...] = ()
    constant: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LogDescription:
    """What is said of a log; what is not is taken from the layout it has.

    Attributes:
        signal: What v is, a name of `MEANINGS`.
        layout: A known layout, a name of `LAYOUTS`; recognised by its columns if not said.
        joints: Names of the joints, base to flange, where the log has joints by name.
        topic: Of a bag.
        only: Columns and the value that rows must have there to be taken.
        t: Of time.
        q: Of positions.
        v: Of currents.
        text: How a text file is laid out.
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
"""Nothing said."""


def over(given: Channels, known: Channels) -> Channels:
    """What is said, and of what is not what a layout knows; nothing of it where other columns are said."""
    if given.columns:
        return given
    own = {each.name: getattr(given, each.name) for each in fields(given)}
    return replace(known, **{name: value for name, value in own.items() if value != getattr(NOTHING, name)})
