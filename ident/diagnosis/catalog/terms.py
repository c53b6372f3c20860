"""Effects that a model of rigid joints with simple friction lacks; they may look like faults of the logs."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.polynomial import legendre

from ident.diagnosis.alternative import Direction, Term
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.free_model import COUPLED
from ident.diagnosis.logs import Logs
from ident.estimation.joint_by_joint.gain_system import JointRows
from ident.support.arrays import Array, readonly

ELASTICITY = "joint elasticity"
OFFSET, OFFSET_DRIFT = "offset", "offset drift"
"""Families of the current sensor, which are not effects of the arm."""
MESSAGES = {
    ELASTICITY: (
        "the joints are elastic, which is not modelled",
        "model it (nls with compliance), or move more slowly",
    ),
    "position-dependent torque": (
        "a torque that depends on the joint's position is not modelled",
        "check for a spring, a cable or a kinematic error",
    ),
    "friction law": (
        "the friction law of the model does not fit",
        "choose a friction law that fits (nls, friction)",
    ),
    "friction drift": ("friction changes within the logs", "warm the drives up before recording"),
    "current drift": (
        "the currents' scale drifts within the log",
        "warm the drives up before recording; magnets weaken with temperature",
    ),
    OFFSET: (
        "the currents are offset from those of the first log",
        "warm the drives up before recording, and zero the current sensors once for all logs",
    ),
    OFFSET_DRIFT: (
        "the offset of the currents drifts within the log",
        "warm the drives up before recording, and zero the current sensors",
    ),
}
"""Description and remedy of each term."""
DEGREE = 6
"""Degrees of the polynomials in position, and of those in speed for each direction."""


def elasticity(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Elastic joints, each with its own compliance."""
    size = np.where(reference.compliance > 0.0, reference.compliance, 1.0)
    yield _term(ELASTICITY, (), logs, tuple(each * size for each in reference.softened))


def position(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Torque that depends on the joint's position: a spring, a cable, a kinematic error."""
    yield from _curves("position-dependent torque", logs, lambda q, dq: _polynomials(q, DEGREE))


def speed(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Friction with another dependence on speed."""

    def columns(q: Array, dq: Array) -> Array:
        even = _polynomials(np.abs(dq), DEGREE // 2)
        return np.hstack((even, np.sign(dq)[:, None] * even))

    yield from _curves("friction law", logs, columns)


def warming(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Friction that changes within each log."""
    for rows in logs.model.rows:
        own = [
            rows.names.index(f"{name}{rows.joint + 1}")
            for name in ("Fv", "Fc")
            if f"{name}{rows.joint + 1}" in rows.names
        ]
        if own:
            since = rows.position / max(1, int(rows.position.max(initial=1))) - 0.5
            parts = [rows.W[:, own] * (since * (rows.motion == log))[:, None] for log in range(len(logs.recordings))]
            yield _alone("friction drift", rows.joint, logs, np.hstack(parts))


def coupled_friction(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Friction of a motor that turns with two joints, different in a later log."""
    for rows in logs.model.rows:
        coupled = [k for k, name in enumerate(rows.names) if name.rstrip("0123456789") in COUPLED]
        later = range(1, len(logs.recordings))
        if coupled and later:
            parts = [rows.W[:, coupled] * (rows.motion == log)[:, None] for log in later]
            yield _alone("friction drift", rows.joint, logs, np.hstack(parts))


def current_drift(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Currents of one log whose scale drifts during the log, of all joints or of one."""
    n = logs.structure.arm.n
    for log in range(len(logs.recordings)):
        columns = list[Array]()
        for rows, explained in zip(logs.model.rows, reference.explained(log), strict=True):
            last = int(rows.position[rows.motion == log].max(initial=1))
            columns.append((explained * (rows.position / max(1, last) - 0.5))[:, None])
        for joints in ((), *((j,) for j in range(n))):
            chosen = tuple(each if not joints or j in joints else None for j, each in enumerate(columns))
            yield replace(_term("current drift", joints, logs, chosen), logs=(log,), unit="%", scale=100.0)


def offsets(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Offsets of currents that differ between logs or drift within one: of one joint, or of all independently."""
    n = logs.structure.arm.n
    for log in range(len(logs.recordings)):
        level, drift = list[Array](), list[Array]()
        for rows in logs.model.rows:
            own = rows.motion == log
            level.append((own * rows.weight)[:, None])
            share = rows.position / max(1, int(rows.position[own].max(initial=1))) - 0.5
            drift.append(level[-1] * share[:, None])
        for family, columns in ((OFFSET, level if log else []), (OFFSET_DRIFT, drift)):
            found = [_alone(family, j, logs, each) for j, each in enumerate(columns)]
            if n > 1 and columns:
                found.append(_term(family, (), logs, tuple(c * (np.arange(n) == j) for j, c in enumerate(columns))))
            yield from (replace(each, logs=(log,)) for each in found)


def _curves(family: str, logs: Logs, columns: Callable[[Array, Array], Array]) -> Iterator[Direction]:
    for rows in logs.model.rows:
        q, dq = states(logs, rows)
        yield _alone(family, rows.joint, logs, columns(q, dq) * rows.weight[:, None])


def states(logs: Logs, rows: JointRows) -> tuple[Array, Array]:
    """Position and speed of a joint at the middle of its rows' filters, each of shape (r,)."""
    q, dq = np.zeros(len(rows.V)), np.zeros(len(rows.V))
    for log, motion in enumerate(logs.problem.motions):
        behind, own = motion.observation.recorded, rows.motion == log
        at = rows.position[own] * behind.decimator.factor + len(behind.decimator.kernel) // 2
        q[own], dq[own] = behind.q[at, rows.joint], behind.dq[at, rows.joint]
    return q, dq


def _alone(family: str, joint: int, logs: Logs, columns: Array) -> Direction:
    n = logs.structure.arm.n
    return _term(family, (joint,), logs, tuple(columns if j == joint else None for j in range(n)))


def _term(family: str, joints: tuple[int, ...], logs: Logs, columns: tuple[Array | None, ...]) -> Direction:
    words, advice = MESSAGES[family]
    sentence = f"joint {joints[0] + 1}: {words}" if joints else words
    return Direction(
        family=family, joints=joints, logs=logs.every, columns=columns,
        term=Term(words=lambda _: sentence, advice=advice, at_fault=family in (OFFSET, OFFSET_DRIFT)),
        unit="", scale=1.0, largest=np.inf,
    )  # fmt: skip


def _polynomials(x: Array, degree: int) -> Array:
    """Legendre polynomials over the range of x, from degree 1, shape (r, degree)."""
    low, high = float(x.min(initial=0.0)), float(x.max(initial=0.0))
    scaled = (2.0 * x - low - high) / max(high - low, 1e-300)
    return readonly(legendre.legvander(scaled, degree)[:, 1:])
