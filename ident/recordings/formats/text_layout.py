"""What is said of how a text file is laid out, where it is not to be found out."""

from dataclasses import dataclass


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
