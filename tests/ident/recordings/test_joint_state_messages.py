"""A message of joint states taken apart, as the library or the standard puts it together."""

import struct

import numpy as np
import pytest
from bags import Sample, message
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.recordings.formats.joint_state_messages import NotJointStates, alike, joint_states, message_layout

LOGGED = ("elbow", "gripper", "wrist_pitch", "shoulder")
Q, V = np.random.default_rng(3).normal(size=(2, 4, 4))
NAMES = st.lists(st.text(max_size=9).filter(lambda text: "\0" not in text), max_size=5)


@settings(max_examples=60, deadline=None)
@given(names=NAMES, frame=st.text(max_size=7).filter(lambda text: "\0" not in text), velocities=st.booleans(),
       efforts=st.booleans(), seconds=st.integers(0, 2**31 - 1))  # fmt: skip
def test_a_message_is_taken_apart_as_the_library_put_it_together(names, frame, velocities, efforts, seconds):
    rng = np.random.default_rng(len(names))
    position, velocity, effort = rng.normal(size=(3, len(names)))
    raw = message(
        Sample(
            stamp=seconds + 0.25,
            names=names,
            position=position,
            velocity=velocity if velocities else (),
            effort=effort if efforts else (),
            frame=frame,
        )
    )
    layout = message_layout(raw)
    assert layout.names == tuple(names)
    found = joint_states(np.frombuffer(raw, dtype=np.uint8)[None], layout)
    np.testing.assert_array_equal(found.position[0], position)
    np.testing.assert_array_equal(found.stamp, seconds + 0.25)
    if efforts and names:
        np.testing.assert_array_equal(found.effort[0], effort)
    else:
        assert found.effort is None


def big_endian(stamp: tuple[int, int], names: tuple[str, ...], position, effort) -> bytes:
    """By hand, after the standard."""
    body = struct.pack(">iI", *stamp) + struct.pack(">I", 1) + b"\0"

    def aligned(size: int) -> bytes:
        return b"\0" * (-len(body) % size)

    body += aligned(4) + struct.pack(">I", len(names))
    for name in names:
        body += aligned(4) + struct.pack(">I", len(name) + 1) + name.encode() + b"\0"
    for values in (position, (), effort):
        body += aligned(4) + struct.pack(">I", len(values))
        if len(values):
            body += aligned(8) + struct.pack(f">{len(values)}d", *values)
    return b"\x00\x00\x00\x00" + body


def test_a_message_with_the_big_end_first_is_read():
    raw = big_endian((11, 500_000_000), ("a", "bcd"), (0.3, -1.7), (2.5, 7.25))
    found = joint_states(np.frombuffer(raw, dtype=np.uint8)[None], message_layout(raw))
    assert found.stamp.tolist() == [11.5]
    assert found.position.tolist() == [[0.3, -1.7]]
    assert found.effort is not None
    assert found.effort.tolist() == [[2.5, 7.25]]


def test_what_is_no_such_message_is_refused():
    raw = message(Sample(stamp=1.0, names=LOGGED, position=Q[0], effort=V[0]))
    for size in range(len(raw)):
        with pytest.raises(NotJointStates):
            message_layout(raw[:size])
    with pytest.raises(NotJointStates, match="its encoding 0007 is not plain CDR"):
        message_layout(b"\x00\x07" + raw[2:])
    with pytest.raises(NotJointStates, match="4 names, 3 positions and 4 efforts"):
        message_layout(message(Sample(stamp=1.0, names=LOGGED, position=Q[0, :3], effort=V[0])))
    with pytest.raises(NotJointStates, match="4 names, 4 positions and 3 efforts"):
        message_layout(message(Sample(stamp=1.0, names=LOGGED, position=Q[0], effort=V[0, :3])))


def test_messages_are_alike_in_all_but_their_numbers():
    one = message(Sample(stamp=1.0, names=LOGGED, position=Q[0], velocity=Q[3], effort=V[0], frame="base"))
    two = message(Sample(stamp=2.5, names=LOGGED, position=Q[1], velocity=Q[2], effort=V[1], frame="base"))
    other = message(Sample(stamp=1.0, names=LOGGED, position=Q[0], velocity=Q[3], effort=V[0], frame="bass"))
    named = message(Sample(stamp=1.0, names=LOGGED[::-1], position=Q[0], velocity=Q[3], effort=V[0], frame="base"))
    rows = np.frombuffer(b"".join((one, two, other, named, one)), dtype=np.uint8).reshape(5, -1)
    assert alike(rows, message_layout(one))[0].tolist() == [True, True, False, False, True]
    for place in range(4, len(one)):
        changed = bytearray(one)
        changed[place] ^= 1
        numbers = any(start <= place < stop for start, stop in message_layout(one).numbers)
        pair = np.frombuffer(one + bytes(changed), dtype=np.uint8).reshape(2, -1)
        assert alike(pair, message_layout(one))[0].tolist() == [True, numbers]
