"""Effect of compliance near resonance: from the torques measured by the currents, not from those of rigid joints.

A link that is deflected by the share x = (f / f0)^2 of its motion transmits 1 / (1 - x) times the torque of a rigid
joint; columns from the torques of rigid joints give 1 + x. Currents contain the exact torque, but also noise, and
friction at reversals whose timing the filters blur. Such columns are therefore replaced by their regression on all
columns from positions (two-stage least squares), which current noise does not affect.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from ident.estimation.all_joints.friction import OwnColumns
from ident.estimation.all_joints.solution import Fitted, Setting
from ident.estimation.all_joints.terms import MOTOR, OFFSET, STRONGEST, TermColumns, braking, of_rows
from ident.estimation.problem import ObservedMotion
from ident.numerics.least_squares import factors
from ident.numerics.signals import delayed, low_passed
from ident.support.arrays import Array

RANK_TOL = 1e-10
"""Relative norm of the new part of a unit column below which it is zero."""


def by_currents(
    ready: Setting, found: TermColumns, before: Fitted, terms: Sequence[Mapping[str, Array]]
) -> tuple[Array, ...]:
    """Return the change of torque of each joint's rows per compliance of each joint, from the torques of the currents.

    Args:
        ready: The problem, from recordings.
        found: The same from the torques of rigid joints.
        before: A fit whose gains and friction convert currents to torques.
        terms: Columns of friction terms that each joint may have, by name.

    Returns:
        n arrays of shape (r_j, n).
    """
    parts: list[list[Array]] = [[] for _ in range(ready.n)]
    for number, (motion, along) in enumerate(zip(ready.problem.motions, found.torques, strict=True)):
        change = along.softened(transmitted(motion, number, before))
        for j, rows in enumerate(parts):
            rows.append(of_rows(motion, change, j))
    regressed: list[Array] = []
    for columns, own, more, first, rows in zip(ready.columns, before.own, terms, found.softened, parts, strict=True):
        beside = np.column_stack((columns.known, *more.values()))
        Q = factors(np.hstack((columns.shared, own.F, first, beside)), rank_tol=RANK_TOL).Q
        regressed.append(Q @ (Q.T @ np.vstack(rows)))
    return tuple(regressed)


def transmitted(motion: ObservedMotion, number: int, before: Fitted) -> Array:
    """Return drive torques without friction, low-passed like the positions, at full rate [N m], shape (N, n).

    Args:
        motion: From a recording.
        number: Its index in the problem.
        before: A fit of the gains and of friction.
    """
    behind = motion.observation.recorded
    recording, dq, h = behind.recording, behind.dating, before.fit.found.h
    v = delayed(recording.v, behind.current_delay / recording.period)
    links = [
        without_friction(v[:, j], dq[:, j], own, phi, number, wired=float(np.sign(h[j]))) / h[j]
        for j, (own, phi) in enumerate(zip(before.own, before.fit.phi, strict=True))
    ]
    return behind.sampled(low_passed(np.column_stack(links), recording.period, behind.cutoff_hz))


def without_friction(V: Array, dq: Array, own: OwnColumns, phi: Array, motion: int, *, wired: float) -> Array:
    """Return the current without friction, shape (N,).

    Gear friction is computed from the torque of links and rotor together, which neglects its error from the rotor's
    torque.

    Args:
        V: Current, shape (N,).
        dq: Speed of the joint, shape (N,).
        own: Own columns of a fit.
        phi: Their values.
        motion: Index of the motion in the problem.
        wired: -1 for a negative gain, else 1.
    """
    value = dict(zip(own.names, phi.tolist(), strict=True))
    against = wired * np.sign(dq)

    def carried(current: Array, form: str) -> Array:
        c = np.clip(value.get(form, 0.0), -STRONGEST, STRONGEST)
        return current / (1.0 + c * against * np.sign(current))

    share = value.get(OFFSET, 0.0)
    load = (1.0 - share) * np.abs(V) + share * np.abs(V - value.get("off", 0.0))
    V = V - value.get(MOTOR, 0.0) * load * against
    return carried(carried(V, "load-through") - braking(dq, own, phi, motion), "load")
