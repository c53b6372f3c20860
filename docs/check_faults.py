"""Mistakes of logs: what each makes of a recording, and what a check says that names it."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from ident.checks.check import Checked
from ident.checks.remark import Grade

from ident.arrays import Array
from ident.structure import Structure, structure_of

RATIOS = (79.4, -158.8)
"""Of gears, for positions on the motor's side."""
NEAR = 0.02
"""Relative error of a ratio that counts as named."""

Samples = tuple[Array, Array, Array]
Change = Callable[[Array, Array, Array], Samples]


@dataclass(frozen=True)
class Fault:
    """A mistake of a log.

    Attributes:
        kind: To be counted under.
        words: What was done to the log.
        change: What makes of t, q, v the log with the mistake.
        named: Whether a check names it.
        undone: Words of the reading that undoes it, None where it is no reading.
    """

    kind: str
    words: str
    change: Change
    named: Callable[[Checked], bool]
    undone: str | None = None


def reading(words: str) -> Callable[[Checked], bool]:
    return lambda found: words in found.named


def seen(pattern: str) -> Callable[[Checked], bool]:
    return lambda found: any(
        re.search(pattern, f"{line.topic}: {line.seen}") for line in found.all_remarks if line.grade is not Grade.GOOD
    )


def ratio(j: int, value: float) -> Callable[[Checked], bool]:
    def named(found: Checked) -> bool:
        told = (re.match(rf"q{j + 1} divided by ([-\d.]+)", words) for words in found.named)
        return any(abs(float(each[1].rstrip(".,")) / value - 1.0) < NEAR for each in told if each)

    return named


def column(x: Array, j: int, values: Array) -> Array:
    x = x.copy()
    x[:, j] = values
    return x


def swapped(x: Array, i: int, j: int) -> Array:
    x = x.copy()
    x[:, [i, j]] = x[:, [j, i]]
    return x


def of_joint(j: int) -> Iterator[Fault]:
    """Faults of one joint, from 0, that change what the model can explain."""
    q_, v_ = f"q{j + 1}", f"v{j + 1}"
    for sign, turn in ((-1, 0), (1, 90), (1, 180), (1, 270), (-1, 90), (-1, 180), (-1, 270)):
        words = q_ + (" negated" if sign < 0 else "") + (f" plus {turn} degrees" if turn else "")
        back = turn if sign < 0 else 360 - turn
        undone = q_ + (" negated" if sign < 0 else "") + (f" plus {back} degrees" if turn else "")
        yield Fault(
            "sign of a position" if not turn else "zero by a quarter turn, negated or not",
            words,
            lambda t, q, v, sign=sign, turn=turn: (t, column(q, j, sign * q[:, j] + np.deg2rad(turn)), v),
            reading(undone),
            undone,
        )
    degrees = f"{q_} in degrees"
    yield Fault(
        "one joint in degrees",
        degrees,
        lambda t, q, v: (t, column(q, j, np.rad2deg(q[:, j])), v),
        reading(degrees),
        degrees,
    )
    for value in RATIOS:
        yield Fault(
            "one joint on the motor's side",
            f"{q_} times {value:g}",
            lambda t, q, v, value=value: (t, column(q, j, value * q[:, j]), v),
            ratio(j, value),
        )
    yield Fault(
        "speed in place of a current",
        v_,
        lambda t, q, v: (t, q, column(v, j, np.gradient(q[:, j], t))),
        seen(rf"{v_} is the speed"),
    )


def of_pair(i: int, j: int) -> Iterator[Fault]:
    """Faults of two joints, from 0."""
    a, b = i + 1, j + 1
    yield Fault(
        "positions exchanged",
        f"q{a} and q{b}",
        lambda t, q, v: (t, swapped(q, i, j), v),
        reading(f"columns q{a} and q{b} exchanged"),
        f"columns q{a} and q{b} exchanged",
    )
    yield Fault(
        "currents exchanged",
        f"v{a} and v{b}",
        lambda t, q, v: (t, q, swapped(v, i, j)),
        reading(f"columns v{a} and v{b} exchanged"),
        f"columns v{a} and v{b} exchanged",
    )
    yield Fault(
        "joints exchanged",
        f"{a} and {b}",
        lambda t, q, v: (t, swapped(q, i, j), swapped(v, i, j)),
        reading(f"joints {a} and {b} exchanged"),
        f"joints {a} and {b} exchanged",
    )
    yield Fault(
        "a column twice",
        f"q{a} in place of q{b}",
        lambda t, q, v: (t, column(q, j, q[:, i]), v),
        seen(rf"q{a} and q{b} hold the same|q{b} and q{a} hold the same"),
    )


def of_all() -> Iterator[Fault]:
    """Faults of all joints."""
    yield Fault(
        "all in another order",
        "reversed",
        lambda t, q, v: (t, q[:, ::-1], v[:, ::-1]),
        reading("joints in reverse order"),
    )
    yield Fault(
        "all in another order",
        "shifted by one",
        lambda t, q, v: (t, np.roll(q, 1, 1), np.roll(v, 1, 1)),
        lambda found: any(words.startswith("joints shifted") for words in found.named),
    )
    for unit, factor in (("in degrees", 180.0 / np.pi), ("in revolutions", 0.5 / np.pi)):
        yield Fault(
            "all in another unit",
            unit,
            lambda t, q, v, factor=factor: (t, factor * q, v),
            reading(f"all positions {unit}"),
        )


def of_log(n: int) -> Iterator[Fault]:
    """Faults that no reading undoes."""
    for j in range(n):
        yield Fault(
            "sign of a current",
            f"v{j + 1} negated",
            lambda t, q, v, j=j: (t, q, column(v, j, -v[:, j])),
            seen(rf"friction of joint {j + 1} drives"),
        )
        yield Fault(
            "clipping",
            f"v{j + 1} at 0.8 of its largest",
            lambda t, q, v, j=j: (t, q, column(v, j, _clipped(v[:, j]))),
            seen(rf"v{j + 1} stays at"),
        )
        yield Fault(
            "wrapped angle",
            f"q{j + 1}",
            lambda t, q, v, j=j: (t, column(q, j, (q[:, j] - q[:, j].mean()) % (2 * np.pi)), v),
            seen(r"values: .*wrapped"),
        )
    for late in (0.01, 0.02, 0.03):
        yield Fault(
            "currents late", f"{1e3 * late:g} ms", lambda t, q, v, late=late: _late(t, q, v, late), seen("delay")
        )
    yield Fault("lost samples", "1 %", lambda t, q, v: _kept(t, q, v, even=False), seen("missing samples"))
    yield Fault("lost samples", "1 %, time even", lambda t, q, v: _kept(t, q, v, even=True), seen("lost samples"))
    yield Fault("lost samples", "a hole of 2.5 %", _hole, seen("missing samples"))
    yield Fault("repeated samples", "1 %", _repeated, seen("repeated samples"))
    yield Fault(
        "time in milliseconds", "", lambda t, q, v: (1e3 * t, q, v), seen("values: .*milliseconds|too slow for")
    )
    yield Fault(
        "a spike",
        "in q2",
        lambda t, q, v: (t, column(q, 1, q[:, 1] + 1.0 * (np.arange(len(t)) == 700)), v),
        seen("values: q2"),
    )


def _clipped(v: Array) -> Array:
    limit = 0.8 * float(np.abs(v).max())
    return np.clip(v, -limit, limit)


def _late(t: Array, q: Array, v: Array, late: float) -> Samples:
    rows = round(late * (len(t) - 1) / (t[-1] - t[0]))
    return t[rows:], q[rows:], v[:-rows]


def _kept(t: Array, q: Array, v: Array, *, even: bool) -> Samples:
    kept = np.random.default_rng(7).random(len(t)) > 0.01
    return t[: kept.sum()] if even else t[kept], q[kept], v[kept]


def _hole(t: Array, q: Array, v: Array) -> Samples:
    left, right = round(0.45 * len(t)), round(0.475 * len(t))
    t, q, v = (np.concatenate((x[:left], x[right:])) for x in (t, q, v))
    return t, q, v


def _repeated(t: Array, q: Array, v: Array) -> Samples:
    again = np.random.default_rng(8).random(len(t)) < 0.01
    rows = np.maximum(np.arange(len(t)) - again, 0)
    return t, q[rows], v[rows]


def model_faults(n: int) -> list[Fault]:
    pairs = [(i, j) for i in range(n) for j in range(i + 1, n)]
    found = [fault for j in range(n) for fault in of_joint(j)]
    found += [fault for i, j in pairs for fault in of_pair(i, j)]
    return [*found, *of_all()]


def base_structures(structure: Structure) -> Iterator[tuple[str, Structure, str]]:
    """The arm with a base that the model has otherwise: which way, the model, the reading that undoes it."""
    for way in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)):
        arm = replace(structure.arm, gravity=np.linalg.norm(structure.arm.gravity) * np.array(way))
        yield f"model's gravity along {way}", structure_of(arm), "gravity along (0, 0, -1) of the base"
