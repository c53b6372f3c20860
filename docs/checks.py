"""Writes checks.md: faults put into recordings one at a time, and what `rx90 check` says of them.

Recordings are simulated at `nominal` noise, of the RX-90 and of a Panda, bare and loaded; those of a folder named by
REAL_RECORDINGS are checked as they are, and with faults.
"""

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from ident.arm import load_arm
from ident.checks.check import Checked, check
from ident.checks.remark import Grade
from ident.errors import RecordingError
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.recording import Recording
from ident.recording_files import read_recording
from ident.structure import Structure, structure_of
from scenarios.build import bench
from scenarios.files.loading import load_scenario
from scenarios.run import Simulated, drawn, motion_streams, simulate_batch

SIMULATED = ("nominal", "panda")
FAULTY_SEED, CLEAN_SEEDS = 500, 100
OBSERVING, GAINS = ObserveOptions(), GainOptions()
RATIO = 79.4
"""Of a gear, for positions on the motor's side."""


@dataclass(frozen=True)
class Fault:
    """A mistake of a log.

    Attributes:
        kind: To be counted under.
        words: What was done to the log.
        change: What makes of t, q, v the log with the mistake.
        names: What a line of the check must say, one of them: a reading, or a topic of a log.
    """

    kind: str
    words: str
    change: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
    names: tuple[str, ...]


def on_q(change):
    return lambda t, q, v: (t, change(q), v)


def on_v(change):
    return lambda t, q, v: (t, q, change(v))


def column(x: np.ndarray, j: int, values: np.ndarray) -> np.ndarray:
    x = x.copy()
    x[:, j] = values
    return x


def swapped(x: np.ndarray, i: int, j: int) -> np.ndarray:
    x = x.copy()
    x[:, [i, j]] = x[:, [j, i]]
    return x


def faults(n: int) -> Iterator[Fault]:
    """Every fault of an arm of n revolute joints."""
    for j in range(n):
        name = f"q{j + 1}"
        yield Fault("sign of a position", f"{name} negated", on_q(lambda q, j=j: column(q, j, -q[:, j])), (f"{name} negated",))
        for turn in (90, 180, 270):
            undo = f"{name} plus {360 - turn} degrees"
            yield Fault("zero by quarter turns", f"{name} plus {turn} degrees",
                        on_q(lambda q, j=j, turn=turn: column(q, j, q[:, j] + np.deg2rad(turn))), (undo,))  # fmt: skip
            yield Fault("sign and quarter turn", f"{name} negated plus {turn} degrees",
                        on_q(lambda q, j=j, turn=turn: column(q, j, np.deg2rad(turn) - q[:, j])), (f"{name} negated plus {turn} degrees",))  # fmt: skip
        yield Fault("unit of one joint", f"{name} in degrees", on_q(lambda q, j=j: column(q, j, np.rad2deg(q[:, j]))), (f"{name} in degrees",))
        for ratio in (RATIO, -2.0 * RATIO):
            yield Fault("motor side", f"{name} times {ratio:g}", on_q(lambda q, j=j, r=ratio: column(q, j, r * q[:, j])), (f"{name} divided by {ratio:.3g}",))
        yield Fault("sign of a current", f"v{j + 1} negated", on_v(lambda v, j=j: column(v, j, -v[:, j])), (f"friction of joint {j + 1} drives",))
        other = (j + 1) % n
        yield Fault("wrong column", f"q{other + 1} in place of {name}", on_q(lambda q, j=j, o=other: column(q, j, q[:, o])), ("hold the same numbers",))
        yield Fault("wrong column", f"speed in place of v{j + 1}",
                    lambda t, q, v, j=j: (t, q, column(v, j, np.gradient(q[:, j], t))), (f"v{j + 1} is the speed",))  # fmt: skip
        yield Fault("clipping", f"v{j + 1} clipped at 0.8 of its largest",
                    on_v(lambda v, j=j: column(v, j, np.clip(v[:, j], -0.8 * np.abs(v[:, j]).max(), 0.8 * np.abs(v[:, j]).max()))), (f"v{j + 1} stays at",))  # fmt: skip
    for i in range(n):
        for j in range(i + 1, n):
            a, b = i + 1, j + 1
            yield Fault("exchanged positions", f"q{a} and q{b}", on_q(lambda q, i=i, j=j: swapped(q, i, j)), (f"columns q{a} and q{b} exchanged",))
            yield Fault("exchanged currents", f"v{a} and v{b}", on_v(lambda v, i=i, j=j: swapped(v, i, j)), (f"columns v{a} and v{b} exchanged",))
            yield Fault("exchanged joints", f"joints {a} and {b}", lambda t, q, v, i=i, j=j: (t, swapped(q, i, j), swapped(v, i, j)), (f"joints {a} and {b} exchanged",))
    yield Fault("all in another order", "joints in reverse", lambda t, q, v: (t, q[:, ::-1], v[:, ::-1]), ("joints in reverse order",))
    yield Fault("all in another order", "joints shifted", lambda t, q, v: (t, np.roll(q, 1, 1), np.roll(v, 1, 1)), ("joints shifted, the last one first", "joints shifted, the first one last"))
    yield Fault("all in another unit", "degrees", on_q(np.rad2deg), ("all positions in degrees",))
    yield Fault("all in another unit", "revolutions", on_q(lambda q: q / (2 * np.pi)), ("all positions in revolutions",))
    yield Fault("clock and samples", "currents 10 ms late", lambda t, q, v: (t[10:], q[10:], v[:-10]), ("delay of v",))
    yield Fault("clock and samples", "currents 20 ms late", lambda t, q, v: (t[20:], q[20:], v[:-20]), ("delay of v",))
    keep = lambda t: np.random.default_rng(7).random(len(t)) > 0.01  # noqa: E731
    yield Fault("clock and samples", "1 % of the samples lost", lambda t, q, v: (t[keep(t)], q[keep(t)], v[keep(t)]), ("missing samples",))
    yield Fault("clock and samples", "1 % of the samples lost, time even",
                lambda t, q, v: (t[: keep(t).sum()], q[keep(t)], v[keep(t)]), ("lost samples",))  # fmt: skip
    yield Fault("clock and samples", "a hole of 0.5 s", lambda t, q, v: tuple(np.concatenate((x[:9000], x[9500:])) for x in (t, q, v)), ("missing samples",))
    def repeat(t, q, v):
        rows = np.arange(len(t))
        again = np.random.default_rng(8).random(len(t)) < 0.01
        rows = np.where(again, np.maximum(rows - 1, 0), rows)
        return t, q[rows], v[rows]
    yield Fault("clock and samples", "1 % of the rows repeat the one before", repeat, ("repeated samples",))
    yield Fault("clock and samples", "time in milliseconds", lambda t, q, v: (1e3 * t, q, v), ("values",))


def base_faults() -> Iterator[tuple[str, np.ndarray, str]]:
    """How a base may stand instead of upright: gravity that the model then has wrongly."""
    for way in ((0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)):
        yield f"gravity along {way} in the model", 9.81 * np.array(way, float), "gravity along (0, 0, -1) of the base"


def simulated(name: str, seeds: Sequence[int]) -> tuple[Structure, list[list[Recording]]]:
    prepared = bench(load_scenario(name))
    ready = [drawn(prepared, seed) for seed in seeds]
    streams = [motion_streams(seed, {}, len(prepared.experiments)) for seed in seeds]
    found = dict(simulate_batch(ready, streams, threads=1))
    return prepared.structure, [list(found[k].recordings) for k in range(len(seeds)) if isinstance(found[k], Simulated)]
