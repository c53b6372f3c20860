"""Faults of columns: zeros, signs, scales, orders, and parts of a column with other content."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from diagnosis_cases import SoundCase
from diagnosis_fault import (
    Change,
    Fault,
    Samples,
    all_joints,
    all_logs,
    column,
    in_logs,
    joint_of,
    last_log,
    number,
    places,
    scaled,
    then,
)

from ident.support.arrays import Array


def zeros(case: SoundCase) -> Iterator[Fault]:
    revolute = case.structure.arm.revolute

    def faults(kind: str, sizes: Sequence[float], logs: tuple[int, ...], first: int) -> Iterator[Fault]:
        for k, size in enumerate(sizes):
            j = joint_of(case, first + k)
            value = float(np.deg2rad(size)) if revolute[j] else 1e-3 * min(abs(size), 60.0) * float(np.sign(size))
            what = f"{size:+g} degrees" if revolute[j] else f"{1e3 * value:+g} mm"
            words = f"q{number(j)} {what} in {'all logs' if len(logs) == len(case.motions) else 'log 2'}"
            change = in_logs(column("q", j, lambda t, x, value=value: x + value), logs)
            yield Fault(kind, words, (j,), logs, value, "rad" if revolute[j] else "m", change)

    yield from faults("zero", (0.5, -2.0, 5.0, 2.0, -5.0), all_logs(case), 0)
    yield from faults("zero far off", (-30.0, 90.0, 180.0, -90.0), all_logs(case), 2)
    if len(case.motions) > 1:
        yield from faults("zero in one log", (1.0, -2.0, 5.0, 30.0), last_log(case), 1)


def signs(case: SoundCase) -> Iterator[Fault]:
    for where, logs in places(case):
        if where == "in log 1":
            continue
        for k in range(3):
            j = joint_of(case, k)
            q, v = f"q{number(j)}", f"v{number(j)}"
            negative_q, negative_v = (
                in_logs(scaled("q", j, -1.0), logs),
                in_logs(scaled("v", j, -1.0), logs),
            )
            end = "" if where == "in all logs" else " in one log"
            yield Fault(f"sign of q{end}", f"{q} negated {where}", (j,), logs, -1.0, "", negative_q)
            harmless = where == "in all logs"  # a drive wired backwards: another gain, and a right one
            yield Fault(f"sign of v{end}", f"{v} negated {where}", (j,), logs, -1.0, "", negative_v, harmless)
            both = then(negative_q, negative_v)
            yield Fault(f"sign of q and v{end}", f"{q} and {v} negated {where}", (j,), logs, -1.0, "", both)


def scales(case: SoundCase) -> Iterator[Fault]:
    every, last, n = all_logs(case), last_log(case), case.structure.arm.n
    turning = [j for j in map(lambda k: joint_of(case, k), range(n)) if case.structure.arm.revolute[j]]
    for k, (factor, what) in enumerate(((180.0 / np.pi, "in degrees"), (63.61, "times 63.61"), (1.05, "times 1.05"))):
        j = turning[k % len(turning)]
        kind = ("one position in degrees", "gear ratio", "scale of a position")[k]
        words = f"q{number(j)} {what} in all logs"
        yield Fault(kind, words, (j,), every, float(factor), "", in_logs(scaled("q", j, float(factor)), every))
    turns = np.where(case.structure.arm.revolute, 180.0 / np.pi, 1.0)
    for where, logs in places(case)[:2]:
        yield Fault(
            "all positions in degrees", where, tuple(turning), logs, float(180.0 / np.pi), "",
            in_logs(lambda t, q, v: (t, q * turns, v), logs),
        )  # fmt: skip
    if len(case.motions) < 2:
        return
    for k, factor in enumerate((1.05, 1.1, 1.3, 0.9)):
        j = joint_of(case, k)
        words = f"v{number(j)} times {factor:g} in log 2"
        yield Fault(
            "scale of a current in one log", words, (j,), last, factor, "", in_logs(scaled("v", j, factor), last)
        )
    for factor in (1.1, 0.95, 1000.0):
        apply = in_logs(lambda t, q, v, factor=factor: (t, q, factor * v), last)
        words = f"all v times {factor:g} in log 2"
        yield Fault("scale of all currents in one log", words, all_joints(case), last, factor, "", apply)


def offsets(case: SoundCase) -> Iterator[Fault]:
    """Of current sensors that are zeroed once, or that warm up: as shares of each joint's rms current."""
    if len(case.motions) < 2:
        return
    last, n = last_log(case), case.structure.arm.n
    sign = np.where(np.arange(n) % 3 == 1, -1.0, 1.0)
    rms = np.sqrt(np.mean(case.motions[last[0]].recording.v ** 2, axis=0))
    for share in (0.03, 0.1, 0.3):
        level = share * sign * rms
        yield Fault(
            "offset of one log", f"{share:g} of the rms in log 2", all_joints(case), last, None, "",
            in_logs(lambda t, q, v, level=level: (t, q, v + level), last),
        )  # fmt: skip
        yield Fault(
            "offset that drifts", f"by {share:g} of the rms in log 2", all_joints(case), last, None, "",
            in_logs(lambda t, q, v, level=level: (t, q, v + np.linspace(0.0, 1.0, len(t))[:, None] * level), last),
        )  # fmt: skip


def _swapped(x: Array, i: int, j: int) -> Array:
    x[:, [i, j]] = x[:, [j, i]]
    return x


def orders(case: SoundCase) -> Iterator[Fault]:
    n = case.structure.arm.n
    changes: dict[str, Callable[[int, int], Change]] = {
        "joints": lambda i, j: lambda t, q, v: (t, _swapped(q, i, j), _swapped(v, i, j)),
        "positions": lambda i, j: lambda t, q, v: (t, _swapped(q, i, j), v),
        "currents": lambda i, j: lambda t, q, v: (t, q, _swapped(v, i, j)),
    }
    for where, logs in places(case)[:2]:
        end = "" if where == "in all logs" else " in one log"
        for what, change in changes.items():
            for k in range(3):
                i = (joint_of(case, 0) + k) % (n - 1)  # three different ones
                j = i + 1 if k < 2 else (i + 2) % n
                i, j = min(i, j), max(i, j)
                words = f"{number(i)} and {number(j)} {where}"
                yield Fault(f"{what} exchanged{end}", words, (i, j), logs, None, "", in_logs(change(i, j), logs))
    every, joints = all_logs(case), all_joints(case)
    for what, order in (("reversed", list(range(n))[::-1]), ("shifted by one", np.roll(np.arange(n), 1).tolist())):
        apply = in_logs(lambda t, q, v, order=order: (t, q[:, order], v[:, order]), every)
        yield Fault("another order", f"all joints {what}", joints, every, None, "", apply)
    apply = in_logs(lambda t, q, v: (t, q, v[:, ::-1]), every)
    yield Fault("another order", "all currents reversed", joints, every, None, "", apply)


def columns(case: SoundCase) -> Iterator[Fault]:
    every, last, n = all_logs(case), last_log(case), case.structure.arm.n
    turning = [j for j in map(lambda k: joint_of(case, k), range(n)) if case.structure.arm.revolute[j]]

    def clipped(t: Array, x: Array, share: float) -> Array:
        limit = share * float(np.abs(x).max())
        return np.clip(x, -limit, limit)

    def wrapped(t: Array, x: Array) -> Array:
        middle = float(np.median(x))  # wrapped there, so that jumps occur; the upper half stays right
        return (x - middle) % (2.0 * np.pi) + middle

    def frozen(t: Array, x: Array, seconds: float) -> Array:
        begin = int(np.searchsorted(t, t[0] + 0.37 * (t[-1] - t[0])))
        end = int(np.searchsorted(t, t[begin] + seconds))
        x = x.copy()
        x[begin:end] = x[begin]
        return x

    def spiked(t: Array, x: Array, size: float) -> Array:
        x = x.copy()
        x[np.random.default_rng(73).choice(len(x), 5, replace=False)] += size
        return x

    for k, share in enumerate((0.95, 0.8, 0.6)):
        j = joint_of(case, k)
        apply = in_logs(column("v", j, lambda t, x, share=share: clipped(t, x, share)), every)
        yield Fault("clipping", f"v{number(j)} at {share:g} of its largest in all logs", (j,), every, share, "", apply)
    for j in turning[:3]:
        apply = in_logs(column("q", j, wrapped), last)
        yield Fault("wrapped angle", f"q{number(j)} in log {last[0] + 1}", (j,), last, float(2.0 * np.pi), "rad", apply)
        for where, logs in places(case)[1:2]:
            apply = in_logs(column("q", j, lambda t, x: x - 2.0 * np.pi), logs)
            words = f"q{number(j)} less a turn {where}"
            yield Fault("a turn", words, (j,), logs, float(-2.0 * np.pi), "rad", apply, harmless=True)
    for k, (which, seconds) in enumerate((("q", 0.2), ("q", 1.0), ("q", 5.0), ("v", 0.2), ("v", 1.0), ("v", 5.0))):
        j = joint_of(case, k)
        apply = in_logs(column(which, j, lambda t, x, seconds=seconds: frozen(t, x, seconds)), last)
        words = f"{which}{number(j)} for {seconds:g} s in log {last[0] + 1}"
        yield Fault(f"frozen {which}", words, (j,), last, seconds, "s", apply)
    for k, size in enumerate((1.0, 0.2, 0.03)):
        j = turning[k % len(turning)]
        apply = in_logs(column("q", j, lambda t, x, size=size: spiked(t, x, size)), every)
        yield Fault("spikes of q", f"q{number(j)}, 5 of {size:g} rad in all logs", (j,), every, size, "rad", apply)
    for k, times in enumerate((30.0, 10.0, 3.0)):
        j = joint_of(case, k)
        change = column("v", j, lambda t, x, times=times: spiked(t, x, times * float(np.std(x))))
        yield Fault(
            "spikes of v",
            f"v{number(j)}, 5 of {times:g} rms in all logs",
            (j,),
            every,
            times,
            "rms",
            in_logs(change, every),
        )
    for k in range(3):
        i, j = joint_of(case, k), joint_of(case, k + 1)

        def copied(t: Array, q: Array, v: Array, i: int = i, j: int = j) -> Samples:
            q[:, j] = q[:, i]
            return t, q, v

        def speed(t: Array, q: Array, v: Array, j: int = j) -> Samples:
            v[:, j] = np.gradient(q[:, j], t)
            return t, q, v

        yield Fault("copied column", f"q{number(i)} in q{number(j)}", (i, j), every, None, "", in_logs(copied, every))
        yield Fault("speed for current", f"v{number(j)} is dq{number(j)}", (j,), every, None, "", in_logs(speed, every))
