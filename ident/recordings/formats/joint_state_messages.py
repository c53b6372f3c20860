"""Numbers of many serialised `sensor_msgs/JointState` messages at once.

Messages of one publisher are alike in all but their numbers: frame and names of the joints stand in the same bytes. So
that a million of them are read as one array, of which the first message says where what is (CDR, OMG DDS-XTypes, plain
encoding 1: numbers are aligned to their own size, counted from behind the header of 4 bytes).
"""

import struct
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array

ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
"""Byte order by the first two bytes of a message."""
HEADER = 4
"""Bytes before those that are aligned."""


class NotJointStates(ValueError):
    """Bytes that are no such message."""


@dataclass(frozen=True, slots=True)
class MessageLayout:
    """Where the numbers of a message are.

    Attributes:
        order: Byte order, `<` or `>`.
        names: Of the joints.
        position: Where the positions begin [bytes], one a joint.
        effort: Where the efforts begin, None if there are none.
        numbers: Stretches of the message, from and to, that hold numbers; all else is alike in messages of one layout.
    """

    order: str
    names: tuple[str, ...]
    position: int
    effort: int | None
    numbers: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True, eq=False)
class JointStates:
    """Numbers of k messages of one layout with n joints.

    Attributes:
        layout: Where they were.
        stamp: Times of their headers [s], shape (k,).
        position: Shape (k, n).
        effort: Shape (k, n), None if they have none.
    """

    layout: MessageLayout
    stamp: Array
    position: Array
    effort: Array | None


def message_layout(message: bytes) -> MessageLayout:
    """Where the numbers of a message are.

    Raises:
        NotJointStates: If it is no such message.
    """
    order = ORDERS.get(message[:2])
    if order is None:
        raise NotJointStates(f"its encoding {message[:2].hex()} is not plain CDR")
    reader = _Reader(message, order, HEADER + 8)  # behind the stamp: seconds and nanoseconds, four bytes each
    try:
        reader.text()
        names = tuple(reader.text() for _ in range(reader.count(least=5)))
        arrays = [reader.numbers() for _ in range(3)]
    except (struct.error, UnicodeDecodeError) as error:
        raise NotJointStates(f"it cannot be read ({error})") from error
    (at, many), _, (effort, efforts) = arrays
    if many != len(names) or efforts not in (0, many):
        raise NotJointStates(f"it has {len(names)} names, {many} positions and {efforts} efforts")
    numbers = ((HEADER, HEADER + 8), *((start, start + 8 * count) for start, count in arrays))
    return MessageLayout(order, names, at, effort if efforts else None, numbers)


def joint_states(rows: np.ndarray, layout: MessageLayout) -> JointStates:
    """The numbers of messages of one layout.

    Args:
        rows: Bytes, one message a row, shape (k, length).
        layout: Their layout.
    """
    n, order = len(layout.names), layout.order
    seconds = _numbers(rows, HEADER, f"{order}i4", 1)[:, 0]
    nanoseconds = _numbers(rows, HEADER + 4, f"{order}u4", 1)[:, 0]
    return JointStates(
        layout,
        seconds + 1e-9 * nanoseconds,
        _numbers(rows, layout.position, f"{order}f8", n).astype(np.float64),
        None if layout.effort is None else _numbers(rows, layout.effort, f"{order}f8", n).astype(np.float64),
    )


def alike(rows: np.ndarray, layout: MessageLayout) -> tuple[np.ndarray, bytes]:
    """Which messages have the layout of the first, shape (k,), and what these have in common: all but their numbers."""
    text = np.ones(rows.shape[1], dtype=bool)
    for start, stop in layout.numbers:
        text[start:stop] = False
    same = rows[:, text]
    return (same == same[0]).all(axis=1), same[0].tobytes()


def _numbers(rows: np.ndarray, start: int, kind: str, count: int) -> np.ndarray:
    size = np.dtype(kind).itemsize * count
    return np.ascontiguousarray(rows[:, start : start + size]).view(kind).reshape(len(rows), count)


class _Reader:
    """Reads a message from some place on."""

    def __init__(self, message: bytes, order: str, at: int) -> None:
        self.message, self.order, self.at = message, order, at

    def count(self, least: int) -> int:
        """A number of entries of so many bytes at least."""
        self.at = _aligned(self.at, 4)
        (many,) = struct.unpack_from(f"{self.order}I", self.message, self.at)
        self.at += 4
        if many * least > len(self.message) - self.at:
            raise struct.error(f"{many} entries are more than it holds")
        return many

    def text(self) -> str:
        """A text, which ends with a zero byte."""
        size = self.count(least=1)
        self.at += size
        return self.message[self.at - size : self.at].rstrip(b"\0").decode()

    def numbers(self) -> tuple[int, int]:
        """Where an array of float64 begins, and how many they are."""
        many = self.count(least=8)
        start = _aligned(self.at, 8) if many else self.at
        self.at = start + 8 * many
        if self.at > len(self.message):
            raise struct.error(f"{many} numbers are more than it holds")
        return start, many


def _aligned(at: int, size: int) -> int:
    return HEADER + -(-(at - HEADER) // size) * size
