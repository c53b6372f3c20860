"""Definition of a fault, and its parts: changes of columns, of logs, of specified values.

A fault says what was *done*: a zero of +5 degrees adds 5 degrees to the logged positions, a delay of +10 ms makes the
currents of the log come 10 ms after what they belong to, a scale of 1.1 multiplies what is logged.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from diagnosis_cases import SoundCase

from ident.model.structure import Structure
from ident.payload.payload import Payload
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array

Motions = tuple[Motion, ...]
Apply = Callable[[Motions, Structure], tuple[Motions, Structure]]
Samples = tuple[Array, Array, Array]
Change = Callable[[Array, Array, Array], Samples]
"""What makes of t, q, v others."""


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """A mistake.

    Attributes:
        kind: Family that it is counted under.
        words: What was done, with size and place; unique for an arm.
        joints: Concerned, from 0; all where no joint is singled out and every one is concerned.
        logs: Changed, from 0.
        value: True size with its sign, None where there is none.
        unit: Of the value.
        apply: Converts the true motions and structure to the assumed ones.
        harmless: Whether gains stay what they are, so that silence is right as well.
    """

    kind: str
    words: str
    joints: tuple[int, ...]
    logs: tuple[int, ...]
    value: float | None
    unit: str
    apply: Apply
    harmless: bool = False


def joint_of(case: SoundCase, k: int) -> int:
    """A joint, k after k spread over the arm, others first for other cases."""
    n = case.structure.arm.n
    return (k * (2 if n % 2 else 5 if n == 6 else 3) + sum(case.name.encode())) % n


def all_logs(case: SoundCase) -> tuple[int, ...]:
    return tuple(range(len(case.motions)))


def last_log(case: SoundCase) -> tuple[int, ...]:
    """The loaded log, or the only one."""
    return (min(1, len(case.motions) - 1),)


def places(case: SoundCase) -> list[tuple[str, tuple[int, ...]]]:
    """All logs, the bare and the loaded one, in words."""
    if len(case.motions) == 1:
        return [("in all logs", (0,))]
    return [("in all logs", all_logs(case)), ("in log 2", (1,)), ("in log 1", (0,))]


def all_joints(case: SoundCase) -> tuple[int, ...]:
    return tuple(range(case.structure.arm.n))


def in_logs(change: Change, logs: Sequence[int]) -> Apply:
    """A change of samples in some logs."""

    def apply(motions: Motions, structure: Structure) -> tuple[Motions, Structure]:
        changed = list(motions)
        for k in logs:
            log = motions[k].recording
            t, q, v = change(log.t.copy(), log.q.copy(), log.v.copy())
            changed[k] = replace(motions[k], recording=Recording(t, q, v, log.name))
        return tuple(changed), structure

    return apply


def believed(change: Callable[[Payload], Payload]) -> Apply:
    """A change of the specified payload; logs of one mounting continue to share the object."""

    def apply(motions: Motions, structure: Structure) -> tuple[Motions, Structure]:
        others = {id(each.payload): change(each.payload) for each in motions if each.payload is not None}
        return tuple(replace(each, payload=others.get(id(each.payload))) for each in motions), structure

    return apply


def modelled(change: Callable[[Structure], Structure]) -> Apply:
    return lambda motions, structure: (motions, change(structure))


def then(first: Apply, second: Apply) -> Apply:
    return lambda motions, structure: second(*first(motions, structure))


def column(which: str, j: int, change: Callable[[Array, Array], Array]) -> Change:
    """A change of one column of q or v, given t and the column."""

    def changed(t: Array, q: Array, v: Array) -> Samples:
        x = q if which == "q" else v
        x[:, j] = change(t, x[:, j])
        return t, q, v

    return changed


def scaled(which: str, j: int, factor: float) -> Change:
    return column(which, j, lambda t, x: factor * x)


def number(j: int) -> int:
    return j + 1
