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
from ident.arrays import Array
from ident.diagnosis.alternative import Alternative
from ident.diagnosis.logs import Logs
from ident.diagnosis.reading import LogReading, Reading, as_logged
from ident.explanation import Unknowns, unknowns_of
from ident.instants import Instants, instants
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
        left: Share of each column that it leaves, shape (n,).
        told: Share of the currents by which the two explanations differ, all columns together.
    """

    alternative: Alternative
    gain: Array
    left: Array


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
        """Mean square that a reading leaves of each column of currents, and degrees of freedom, each of shape (n,)."""
        arm = self._arm(reading)
        parts = [self.normal(k, how, arm) for k, how in enumerate(reading.logs)]
        n = arm.n
        left, freedom = np.full(n, np.inf), np.zeros(n)
        for j in range(n):
            gram = sum((each.gram[j] for each in parts[1:]), parts[0].gram[j])
            columns = [int(how.v_order[j]) for how in reading.logs]
            rhs = sum((e.rhs[j][:, c] * s[j] for e, c, s in self._signed(parts, columns, reading)), np.zeros(len(gram)))
            square = sum(float(e.square[j, c]) * s[j] ** 2 for e, c, s in self._signed(parts, columns, reading))
            size = np.sqrt(np.maximum(np.diag(gram), 1e-300))
            unit = gram / np.outer(size, size)
            felt = np.diag(gram) > 0.0
            unit[np.diag_indices_from(unit)] += RIDGE
            b = rhs / size
            unit, b = unit[np.ix_(felt, felt)], b[felt]
            rows = sum(float(each.rows[j]) for each in parts)
            many = rows - len(b)
            if many < 1:
                continue
            left[columns[0]] = max(square - float(b @ np.linalg.solve(unit, b)), 0.0) / many
            freedom[columns[0]] = many
        return left, freedom

    def _arm(self, reading: Reading) -> Arm:
        own = self.logs.structure.arm
        arm = reading.of_arm(own)
        return arm

    @staticmethod
    def _signed(parts: Sequence[_Normal], columns: Sequence[int], reading: Reading):
        return zip(parts, columns, [how.v_factor for how in reading.logs], strict=True)


def screened(screen: Screen, alternatives: Sequence[Alternative]) -> list[Screened]:
    """What alternatives gain on few instants, the best first."""
    arm = screen.logs.structure.arm
    given, freedom = screen.left(as_logged(arm, len(screen.at)))
    scale = np.concatenate([each.v for each in screen.at])
    noise = NOTHING**2 * np.mean(scale**2, axis=0)
    found = list[Screened]()
    for each in alternatives:
        left, own = screen.left(each.reading)
        known = np.isfinite(given) & np.isfinite(left)
        ratio = np.where(known, np.maximum(given, noise) / np.maximum(left, noise), 1.0)
        gain = 0.5 * np.minimum(freedom, own) * np.log(np.where(known, ratio, 1.0))
        found.append(Screened(each, gain, np.sqrt(left / np.mean(scale**2, axis=0))))
    return sorted(found, key=lambda each: -float(each.gain.sum()))


NOTHING = 1e-3
"""Share of a current below which nothing is left to explain: filters leave as much of exact data."""


@lru_cache(maxsize=8)
def _unknowns(structure: Structure, *, upright: bool) -> Unknowns:
    """Columns that each joint is solved for, under the model's gravity or under any."""
    if upright or not structure.arm.gravity.any():
        return unknowns_of(structure)
    return unknowns_of(structure_of(replace(structure.arm, gravity=ASLANT)))
