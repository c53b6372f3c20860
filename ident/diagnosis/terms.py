"""Effects that a model of rigid joints with simple friction lacks, and payloads that are not as specified.

They may look like faults of the logs, and compete with these as columns of currents.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.polynomial import legendre

from ident.diagnosis.diagnosis import two_digits
from ident.diagnosis.hypothesis import Alternative, Logs, as_logged, small
from ident.diagnosis.models import COUPLED, Reference
from ident.estimation.estimate import GainEstimate
from ident.estimation.problem import Columns, Problem, joint_rows
from ident.payload.payload import Payload
from ident.support.arrays import Array, readonly

ELASTICITY = "joint elasticity"
OFFSET, OFFSET_DRIFT, CURRENT_DRIFT = "offset", "offset drift", "current drift"
"""Families of the current sensor, which are not effects of the arm."""
WARM_UP = "warm the drives up before recording"
MESSAGES = {
    ELASTICITY: (
        "the joints are elastic, which is not modelled",
        "model it (nls with compliance), or move more slowly",
    ),
    "position-dependent torque": (
        "a torque that depends on the joint's position is not modelled",
        "check for a spring, a cable or a kinematic error",
    ),
    "friction law": ("the friction law of the model does not fit", "choose a friction law that fits (nls, friction)"),
    "friction drift": ("friction changes within the logs", WARM_UP),
    CURRENT_DRIFT: ("the currents' scale drifts within the log", f"{WARM_UP}; magnets weaken with temperature"),
    OFFSET: (
        "the currents are offset from those of the first log",
        f"{WARM_UP}, and zero the current sensors once for all logs",
    ),
    OFFSET_DRIFT: ("the offset of the currents drifts within the log", f"{WARM_UP}, and zero the current sensors"),
}
"""Description and remedy of each term."""
DEGREE = 6
"""Degrees of the polynomials in position, and of those in speed for each direction."""


def elasticity(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Elastic joints, each with its own compliance."""
    yield _term(ELASTICITY, logs, reference.softened())


def position(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Torque that depends on the joint's position: a spring, a cable, a kinematic error."""
    for j, rows in enumerate(logs.rows):
        columns = _polynomials(states(logs, rows)[0], DEGREE) * rows.weight[:, None]
        yield _term("position-dependent torque", logs, columns, (j,))


def speed(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Friction with another dependence on speed."""
    for j, rows in enumerate(logs.rows):
        dq = states(logs, rows)[1]
        even = _polynomials(np.abs(dq), DEGREE // 2)
        columns = np.hstack((even, np.sign(dq)[:, None] * even)) * rows.weight[:, None]
        yield _term("friction law", logs, columns, (j,))


def _polynomials(x: Array, degree: int) -> Array:
    """Legendre polynomials over the range of x, from degree 1, shape (r, degree)."""
    low, high = float(x.min(initial=0.0)), float(x.max(initial=0.0))
    scaled = (2.0 * x - low - high) / max(high - low, 1e-300)
    return readonly(legendre.legvander(scaled, degree)[:, 1:])


def states(logs: Logs, rows: Columns) -> tuple[Array, Array]:
    """Position and speed of a joint at the middle of its rows' filters, each of shape (r,)."""
    q, dq = np.zeros(len(rows.V)), np.zeros(len(rows.V))
    for log, motion in enumerate(logs.problem.motions):
        behind, own = motion.observation.recorded, rows.motion == log
        at = rows.position[own] * behind.decimator.factor + len(behind.decimator.kernel) // 2
        q[own], dq[own] = behind.q[at, rows.joint[own]], behind.dq[at, rows.joint[own]]
    return q, dq


def warming(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Friction that changes within each log."""
    for j, rows in enumerate(logs.rows):
        own = rows.of_parameter("Fv", "Fc")
        if own.any():
            time = [(rows.since_middle() * (rows.motion == log))[:, None] for log in logs.every]
            yield _term("friction drift", logs, np.hstack([rows.W[:, own] * each for each in time]), (j,))


def coupled_friction(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Friction of a motor that turns with two joints, different in a later log."""
    for j, rows in enumerate(logs.rows):
        coupled = rows.of_parameter(*COUPLED)
        if coupled.any() and len(logs.recordings) > 1:
            parts = [rows.W[:, coupled] * (rows.motion == log)[:, None] for log in logs.every[1:]]
            yield _term("friction drift", logs, np.hstack(parts), (j,))


def current_drift(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Currents of one log whose scale drifts during the log, of all joints or of one."""
    for log in logs.every:
        explained = zip(logs.rows, reference.within(reference.explained, (log,)), strict=True)
        columns = [own * rows.since_middle(log)[:, None] for rows, own in explained if own is not None]
        yield _term(CURRENT_DRIFT, logs, columns, (), (log,))
        yield from (_term(CURRENT_DRIFT, logs, each, (j,), (log,)) for j, each in enumerate(columns))


def offsets(reference: Reference, logs: Logs) -> Iterator[Alternative]:
    """Offsets of currents that differ between logs or drift within one: of one joint, or of all independently."""
    n = logs.structure.arm.n
    for log in logs.every:
        level = [((rows.motion == log) * rows.weight)[:, None] for rows in logs.rows]
        drift = [own * rows.since_middle(log)[:, None] for own, rows in zip(level, logs.rows, strict=True)]
        for family, columns in ((OFFSET, level if log else []), (OFFSET_DRIFT, drift)):
            yield from (_term(family, logs, each, (j,), (log,)) for j, each in enumerate(columns))
            if n > 1 and columns:
                yield _term(family, logs, [c * (np.arange(n) == j) for j, c in enumerate(columns)], (), (log,))


TERMS: dict[str, Callable[[Reference, Logs], Iterator[Alternative]]] = {
    ELASTICITY: elasticity,
    "position-dependent torque": position,
    "friction law": speed,
    "friction drift": warming,
    "friction of couplings": coupled_friction,
    CURRENT_DRIFT: current_drift,
    "offsets": offsets,
}


def _term(
    family: str, logs: Logs, columns: Array | Sequence[Array], joints: tuple[int, ...] = (), scope: tuple[int, ...] = ()
) -> Alternative:
    """Return a term with columns of every joint, or of one, in all logs or some."""
    (words, advice), scale = MESSAGES[family], 100.0 if family == CURRENT_DRIFT else 1.0
    found = Alternative(
        family=family, words=f"joint {joints[0] + 1}: {words}" if joints else words, joints=joints,
        logs=scope or logs.every, hypothesis=logs.given, advice=advice, unit="%" if family == CURRENT_DRIFT else "",
        term=True, at_fault=family in (OFFSET, OFFSET_DRIFT),
        refined=lambda value: replace(found, value=_single(value, scale)),
    )  # fmt: skip
    if isinstance(columns, np.ndarray):
        own = [columns if j in joints else None for j in range(logs.structure.arm.n)]
    else:
        own = columns
    return small(found, own, scale=scale)


def _single(value: Array, scale: float) -> float | None:
    """Reported size of one parameter, None for several."""
    return float(value[0]) * scale if len(value) == 1 else None


KNOWN_CENTRE = ("all", "com")
"""Payloads with a specified centre of mass."""
ROUNDING = 1e-9
"""Ratio of the sizes of effects below which the smaller one is a rounding error."""
CENTRE, INERTIA, SHIFT = "payload centre", "payload inertia", "payload shift"
MEASURE_CENTRE = "measure the payload's centre of mass, and weigh it with all that is mounted; check axes and units"
OF_PAYLOAD: dict[str, tuple[Callable[[Array], str], str]] = {
    CENTRE: (
        lambda offset: f"the payload's centre of mass seems to differ from the specified one by ({_in_mm(offset)}) mm",
        MEASURE_CENTRE,
    ),
    INERTIA: (
        lambda _: "the payload's inertia seems to differ from the specified one",
        "check the payload's inertia: axes, reference point and units",
    ),
    SHIFT: (
        lambda offset: (
            "the payload seems to move in its mount, its centre of mass by some "
            f"({_in_mm(offset[len(offset) // 2 :])}) mm from beginning to end,"
        ),
        "fasten the payload, and record this motion again",
    ),
}
"""Description, from all values [SI], and remedy of each error of a payload."""


def _in_mm(offset: Array) -> str:
    """Components of an offset [m] in words; `-` for those without effect, which are NaN."""
    return ", ".join("-" if np.isnan(x) else two_digits(1e3 * x, sign="+") for x in offset)


def payload_errors(problem: Problem, estimate: GainEstimate) -> Iterator[Alternative]:
    """Errors of the specified centre of mass and inertia of each payload, and its shift within a log."""
    rows = [joint_rows(problem, j) for j in range(problem.structure.arm.n)]
    inverse = dict(zip(estimate.solution.joints.tolist(), estimate.solution.inverse.tolist(), strict=True))
    for which, payload in enumerate(problem.payloads):
        currents = [inverse[j] * own.W_L[which] if j in inverse else None for j, own in enumerate(rows)]
        if payload.known in KNOWN_CENTRE:
            yield _of_payload(problem, which, currents, CENTRE, per_metre(payload))
        if payload.known == "all":
            yield _of_payload(problem, which, currents, INERTIA, np.eye(10)[:, :6])
        fixed = _of_payload(problem, which, currents, SHIFT, payload.mass * np.eye(10)[:, 6:9])
        for log in fixed.logs:  # its mean within the log, then its growth in proportion to time
            time = [(each.since_middle(log) * (each.motion == log))[:, None] for each in rows]
            columns = (None if c is None else np.hstack((c, t * c)) for c, t in zip(fixed.columns, time, strict=True))
            yield replace(fixed, logs=(log,), columns=tuple(columns), parameters=2 * fixed.parameters)


def per_metre(payload: Payload) -> Array:
    """Change of a payload's known standard parameters per metre of its centre along each axis, shape (10, 3)."""
    return replace(payload, com_std=(1.0, 1.0, 1.0)).known_part().spread[:, 1:4]


def _of_payload(
    problem: Problem, which: int, currents: Sequence[Array | None], family: str, change: Array
) -> Alternative:
    """Return the currents from a change of a payload's parameters, (10, m), without columns that have no effect."""
    columns = tuple(None if own is None else own @ change for own in currents)
    size = np.sqrt(np.sum([np.sum(each**2, axis=0) for each in columns if each is not None], axis=0))
    felt, (words, advice) = size > ROUNDING * size.max(), OF_PAYLOAD[family]
    mounted, scale = problem.payloads[which], 1.0 if family == INERTIA else 1e3
    found = Alternative(
        family=family, parameter=CENTRE if family == SHIFT else "", words="", joints=(),
        logs=tuple(k for k, m in enumerate(problem.motions) if m.payload is mounted),
        hypothesis=as_logged(problem.structure.arm, len(problem.motions)), advice=advice,
        unit="kg m^2" if family == INERTIA else "mm", term=True,
    )  # fmt: skip

    def sized(values: Array) -> Alternative:
        each = np.full((len(values) // max(1, felt.sum()), len(felt)), np.nan)
        each[:, felt] = values.reshape(len(each), felt.sum())
        return replace(found, words=words(each.ravel()), value=_single(values, scale))

    std = np.array(mounted.com_std)[felt] if family == CENTRE and any(mounted.com_std) else None
    own = [None if each is None else each[:, felt] for each in columns]
    return small(replace(found, refined=sized, prior_std=std), own, scale=scale)
