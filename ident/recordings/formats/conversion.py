"""From a log's own columns to a recording's: time in seconds, positions in radians or metres, v in one unit."""

from pathlib import Path
from typing import TypeVar

import numpy as np

from ident.recordings.formats.columns import Columns
from ident.recordings.formats.description import Channels, LogDescription
from ident.recordings.formats.meaning import MEANINGS
from ident.recordings.formats.units import POSITION, TICKS, TIME
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Mask
from ident.support.errors import RecordingError
from ident.support.naming import one_line, shown

Value = TypeVar("Value", str, float)


def converted(path: Path, table: Columns, description: LogDescription) -> Recording:
    """The recording that columns are.

    Args:
        path: The file, for messages.
        table: Its columns.
        description: What they are, complete.

    Raises:
        RecordingError: If no row is wanted, or the values fail the checks of `Recording`.
    """
    kept = _kept(path, table, description)
    t = _scaled(_of(table, description.t.columns[0], kept), TIME[description.t.unit[0]])
    q, v = np.empty((2, len(t), len(description.q.columns)))
    for joint, name in enumerate(description.q.columns):
        q[:, joint] = _position(_of(table, name, kept), description.q, joint)
    for joint, name in enumerate(description.v.columns):
        v[:, joint] = _scaled(_of(table, name, kept), _v_scale(description, joint))
    return Recording(t, q, v, one_line(path))


def _kept(path: Path, table: Columns, description: LogDescription) -> Mask | None:
    """Rows that are wanted, None for all."""
    if not description.only:
        return None
    kept = np.ones(len(table[description.only[0][0]]), dtype=bool)
    for name, value in description.only:
        there = table[name] == value
        if not there.any():
            low, high = np.min(table[name]), np.max(table[name])
            raise RecordingError(
                f"{one_line(path)}: no row has {shown(name)} = {value:g}; it ranges from {low:g} to {high:g}"
            )
        kept &= there
    if not kept.any():
        raise RecordingError(f"{one_line(path)}: no row satisfies all conditions of only = {{ .. }}")
    return kept


def _of(table: Columns, name: str, kept: Mask | None) -> Array:
    return table[name] if kept is None else table[name][kept]


def _position(x: Array, channels: Channels, joint: int) -> Array:
    """`unit (sign x + zero)`."""
    unit = _each(channels.unit, joint)
    scale = POSITION[unit]
    if unit == TICKS:
        scale /= _each(channels.counts_per_turn, joint)
    x = _scaled(x, _each(channels.sign, joint) if channels.sign else 1.0)
    if channels.zero:
        x = x + _each(channels.zero, joint)
    return _scaled(x, scale)


def _v_scale(description: LogDescription, joint: int) -> float:
    """Factor from the logged v to that of the recording."""
    scale = _each(description.v.sign, joint) if description.v.sign else 1.0
    if description.signal is not None:
        scale *= MEANINGS[description.signal].units[_each(description.v.unit, joint)]
    return scale / _each(description.v.constant, joint) if description.v.constant else scale


def _each(values: tuple[Value, ...], joint: int) -> Value:
    """The entry of a joint, or that of all joints."""
    return values[joint if len(values) > 1 else 0]


def _scaled(x: Array, factor: float) -> Array:
    return x if factor == 1.0 else x * factor
