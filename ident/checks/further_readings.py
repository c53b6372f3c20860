"""More that a log may mean: other units, and other orders of all columns.

`ident.readings` has single mistakes that an identification looks for every time; these cost more, and need not be
looked for where a log is known to be sound.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.arm import Arm
from ident.arrays import Indices
from ident.readings import Reading, as_it_is

UNITS = {"in degrees": np.pi / 180.0, "in revolutions": 2.0 * np.pi, "in milliradians": 1e-3}
"""What makes radians of an angle in another unit."""
SINGLE = ("in degrees", "in millimetres")
"""Units that one joint of several may have alone."""
LENGTH_UNITS = {"in millimetres": 1e-3}
"""What makes metres of a length."""


def further_readings(arm: Arm) -> Iterator[tuple[Reading, ...]]:
    """Readings with one mistake that `readings` lacks; as there, those of one family share states."""
    given = as_it_is(arm)
    yield from _units(arm, given)
    yield from _orders(arm, given)


def _units(arm: Arm, given: Reading) -> Iterator[tuple[Reading]]:
    """All positions of one kind, or those of one joint, in another unit."""
    for kind, units in ((arm.revolute > 0, UNITS), (arm.revolute == 0, LENGTH_UNITS)):
        joints = np.flatnonzero(kind)
        for name, factor in units.items():
            if len(joints) > 1:
                yield (replace(given, words=f"all positions {name}", factor=np.where(kind, factor, 1.0)),)
            for j in joints if name in SINGLE or len(joints) == 1 else ():
                factors = np.where(np.arange(arm.n) == j, factor, 1.0)
                yield (replace(given, words=f"q{j + 1} {name}", factor=factors),)


def _orders(arm: Arm, given: Reading) -> Iterator[tuple[Reading, ...]]:
    """All joints in another order, positions and currents alike or only one of both."""
    known = {tuple(given.q_order.tolist())}
    for words, order in _other_orders(arm):
        changed = np.sum(order != given.q_order)
        if tuple(order.tolist()) not in known and changed > 2:  # exchanges of two are among the single mistakes
            known.add(tuple(order.tolist()))
            yield (replace(given, words=f"columns v {words}", v_order=order),)
            other = replace(given, words=f"columns q {words}", q_order=order)
            yield other, replace(other, words=f"joints {words}", v_order=order)


def _other_orders(arm: Arm) -> Iterator[tuple[str, Indices]]:
    each = np.arange(arm.n)
    by_name = sorted(range(arm.n), key=lambda j: arm.joint_names[j])
    yield "in alphabetical order of the joints' names", np.argsort(by_name)  # where the column of joint j stands
    yield "in reverse order", each[::-1]
    yield "shifted, the first one last", np.roll(each, 1)
    yield "shifted, the last one first", np.roll(each, -1)
