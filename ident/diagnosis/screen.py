"""Which of many readings are worth a full comparison: all of them on few instants, through normal equations.

Currents are filtered, the regressor is taken at single instants: it lacks what the filter does to products and to
friction steps, so that a small fault may be imitated. What is found here is compared on the estimator's rows
(`ident.diagnosis.comparison`) before anything is said of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.arm import Arm
from ident.arrays import Array, Indices
from ident.base import independent_columns
from ident.diagnosis.alternative import Alternative
from ident.diagnosis.instants import Instants, instants
from ident.diagnosis.logs import Logs
from ident.diagnosis.reading import LogReading, Reading, as_logged
from ident.parameters import STANDARD
from ident.regressor import regressor
from ident.structure import Structure, structure_of

INSTANTS = 120
"""Instants of each log."""
RIDGE = 1e-10
"""As in the comparison, of instants that are fewer."""
ASLANT = np.array([3.6, -4.8, 8.0])
"""Gravity [m/s^2] along no axis: what no torque shows under it, none shows under any."""
DRIFTING = np.array([STANDARD.index(name) for name in ("Fv", "Fc", "off")])


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """What an alternative leaves of each column of currents on the instants, beside the logs as they are.

    Attributes:
        alternative: Which.
        gain: Log likelihood of white residuals that it gains, of each column of currents, shape (n,).
    """

    alternative: Alternative
    gain: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Normal:
    """Normal equations of one log under one reading of it, a joint after the other.

    Attributes:
        gram: Of the columns, n arrays (p, p).
        rhs: Columns times all currents, n arrays (p, n).
        square: Of all currents on the joint's instants, shape (n, n), joint first.
        rows: Instants of each joint, shape (n,).
    """

    gram: list[Array]
    rhs: list[Array]
    square: Array
    rows: Array


class Screen:
    """Normal equations of the logs, each reading of each log once."""

    def __init__(self, logs: Logs) -> None:
        """Look at the logs at few instants."""
        self.logs = logs
        self.at: list[Instants] = [instants(each, INSTANTS, logs.observing) for each in logs.recordings]
        first = logs.problem.motions[0].payload
        self.mounted = [motion.payload is not first for motion in logs.problem.motions]
        self._known: dict[tuple[int, int, int], _Normal] = {}
        self._kept: list[object] = []

    def normal(self, k: int, how: LogReading, arm: Arm) -> _Normal:
        """Of log k under a reading of it."""
        key = (k, id(how), id(arm))
        if key not in self._known:
            self._kept += [how, arm]  # an id is that of one object as long as it lives
            self._known[key] = self._found(k, how, arm)
        return self._known[key]

    def _found(self, k: int, how: LogReading, arm: Arm) -> _Normal:
        at, n = self.at[k], arm.n
        factor = how.q_factor
        q = factor * at.q[:, how.q_order] + how.zero
        dq, ddq = factor * at.dq[:, how.q_order] / how.clock, factor * at.ddq[:, how.q_order] / how.clock**2
        columns = regressor(arm, q, dq, ddq)
        moving = at.moving[:, how.q_order].astype(np.float64)
        unknowns = _unknowns(self.logs.structure, upright=bool((arm.gravity == self.logs.structure.arm.gravity).all()))
        gram, rhs, square = list[Array](), list[Array](), np.zeros((n, n))
        for j in range(n):
            own = columns[:, j]
            parts = [own[:, unknowns.arm[j]]]
            again = own[:, len(STANDARD) * j + DRIFTING]
            for m in range(1, len(self.at)):
                parts.append(again if m == k else np.zeros_like(again))
                if self.mounted[m]:
                    load = own[:, unknowns.payload[j]]
                    parts.append(load if m == k else np.zeros_like(load))
            X = np.hstack(parts) * moving[:, j, None]
            v = at.v * moving[:, j, None]
            gram.append(X.T @ X)
            rhs.append(X.T @ v)
            square[j] = np.sum(v**2, axis=0)
        return _Normal(gram, rhs, square, moving.sum(axis=0))

    def left(self, reading: Reading) -> tuple[Array, Array]:
        """Mean square that a reading leaves of each column of each log in its own unit, and instants, (n, logs)."""
        arm = reading.of_arm(self.logs.structure.arm)
        parts = [self.normal(k, how, arm) for k, how in enumerate(reading.logs)]
        left, many = np.full((arm.n, len(parts)), np.inf), np.zeros((arm.n, len(parts)))
        for j in range(arm.n):
            columns = [int(how.v_order[j]) for how in reading.logs]
            units = [float(how.v_factor[j]) for how in reading.logs]
            grams = [each.gram[j] for each in parts]
            rhs = [each.rhs[j][:, c] * s for each, c, s in zip(parts, columns, units, strict=True)]
            gram, b = sum(grams[1:], grams[0]), sum(rhs[1:], rhs[0])
            felt = np.diag(gram) > 0.0
            size = np.where(felt, np.sqrt(np.where(felt, np.diag(gram), 1.0)), np.inf)
            unit = gram / np.outer(size, size)
            unit[np.diag_indices_from(unit)] += np.where(felt, RIDGE, 1.0)
            x = np.linalg.solve(unit, b / size) / size
            rows = np.array([float(each.rows[j]) for each in parts])
            free = rows.sum() - np.count_nonzero(felt)
            if free < 1.0:
                continue
            for k, (each, c, s) in enumerate(zip(parts, columns, units, strict=True)):
                square = float(each.square[j, c]) * s**2 - 2.0 * float(x @ rhs[k]) + float(x @ grams[k] @ x)
                left[c, k] = max(square, 0.0) / s**2 / free * rows.sum() / max(rows[k], 1.0)
                many[c, k] = rows[k] * free / rows.sum()
        return left, many


def screened(screen: Screen, alternatives: Sequence[Alternative]) -> list[Screened]:
    """What alternatives gain on few instants, the best first."""
    given, freedom = screen.left(as_logged(screen.logs.structure.arm, len(screen.at)))
    noise = NOTHING**2 * np.column_stack([np.mean(each.v**2, axis=0) for each in screen.at])  # (n, logs)
    found = list[Screened]()
    for each in alternatives:
        left, own = screen.left(each.reading)
        known = np.isfinite(given) & np.isfinite(left)
        ratio = np.where(known, np.maximum(given, noise) / np.maximum(left, noise), 1.0)
        gain = 0.5 * np.minimum(freedom, own) * np.log(np.where(known, ratio, 1.0))
        found.append(Screened(each, gain.sum(axis=1)))
    return sorted(found, key=lambda each: -float(each.gain.sum()))


NOTHING = 1e-3
"""Share of a current below which nothing is left to explain: filters leave as much of exact data."""


@dataclass(frozen=True, slots=True, eq=False)
class _Unknowns:
    """Columns of the standard regressor that are solved for on each joint: of the arm, and of a payload."""

    arm: tuple[Indices, ...]
    payload: tuple[Indices, ...]


@lru_cache(maxsize=8)
def _unknowns(structure: Structure, *, upright: bool) -> _Unknowns:
    """Base columns of each joint alone, and those of the payload that it can tell apart, under any gravity if not its.

    What no torque shows under gravity along no axis, none shows under any.
    """
    if not upright and structure.arm.gravity.any():
        structure = structure_of(replace(structure.arm, gravity=ASLANT))
    ten = np.arange(len(structure.payload_columns))
    return _Unknowns(
        arm=tuple(structure.base.columns[chosen] for chosen in structure.joint_independent),
        payload=tuple(
            structure.payload_columns[independent_columns(probes, [ten])] for probes in structure.payload_probes
        ),
    )
