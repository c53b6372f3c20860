"""A payload that is not as specified: its centre of mass, inertia or orientation."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ident.diagnosis.alternative import Direction, Term, two_digits
from ident.estimation.estimate import GainEstimate
from ident.estimation.joint_by_joint.gain_system import joint_rows
from ident.estimation.problem import Problem
from ident.payload.payload import Payload
from ident.support.arrays import Array

KNOWN_CENTRE = ("all", "com")
"""Payloads with a specified centre of mass."""
ROUNDING = 1e-9
"""Ratio of the sizes of effects below which the smaller one is a rounding error."""
FAMILIES = ("payload centre", "payload inertia")
"""Names of the directions' families."""
CENTRE = Term(
    words=lambda offset: (
        f"the payload's centre of mass seems to differ from the specified one by ({_in_mm(offset)}) mm"
    ),
    advice="measure the payload's centre of mass, and weigh it with all that is mounted; check axes and units",
    at_fault=True,
)
INERTIA = Term(
    words=lambda _: "the payload's inertia seems to differ from the specified one",
    advice="check the payload's inertia: axes, reference point and units",
    at_fault=True,
)
SHIFT = Term(
    words=lambda offset: (
        "the payload seems to move in its mount, its centre of mass by some "
        f"({_in_mm(offset[len(offset) // 2 :])}) mm from beginning to end,"
    ),
    advice="fasten the payload, and record this motion again",
    at_fault=True,
)


def _in_mm(offset: Array) -> str:
    """Components of an offset [m] in words; `-` for those without effect, which are NaN."""
    return ", ".join("-" if np.isnan(x) else two_digits(1e3 * x, sign="+") for x in offset)


def directions(problem: Problem, estimate: GainEstimate) -> Iterator[Direction]:
    """Errors of the specified centre of mass and inertia of each payload, and its shift within a log."""
    for which, payload in enumerate(problem.payloads):
        if payload.known in KNOWN_CENTRE:
            yield _of(problem, estimate, which, FAMILIES[0], CENTRE, per_metre(payload), "mm", 1e3, payload.com_std)
        if payload.known == "all":
            inertia = np.zeros((10, 6))
            inertia[:6] = np.eye(6)
            yield _of(problem, estimate, which, FAMILIES[1], INERTIA, inertia, "kg m^2", 1.0)
        moment = np.zeros((10, 3))
        moment[6:9] = payload.mass * np.eye(3)
        carrying = [k for k, motion in enumerate(problem.motions) if motion.payload is payload]
        fixed = _of(problem, estimate, which, "payload shift", SHIFT, moment, "mm", 1e3)
        yield from (_during(problem, fixed, log) for log in carrying)


def per_metre(payload: Payload) -> Array:
    """Change of a payload's known standard parameters per metre of its centre along each axis, shape (10, 3)."""
    return replace(payload, com_std=(1.0, 1.0, 1.0)).known_part().spread[:, 1:4]


def _during(problem: Problem, fixed: Direction, log: int) -> Direction:
    """Return a change within one log: its mean, then its growth in proportion to time."""
    columns = list[Array | None]()
    for j, each in enumerate(fixed.columns):
        rows = joint_rows(problem, j)
        own = rows.motion == log
        share = own * (rows.position / max(1, int(rows.position[own].max(initial=1))) - 0.5)
        columns.append(None if each is None else np.hstack((each, share[:, None] * each)))
    return replace(fixed, logs=(log,), columns=tuple(columns))


def _of(
    problem: Problem,
    estimate: GainEstimate,
    which: int,
    family: str,
    term: Term,
    change: Array,
    unit: str,
    scale: float,
    prior_std: Sequence[float] = (),
) -> Direction:
    """Return the currents from a change of a payload's standard parameters, shape (10, m).

    Changes without effect, as of a centre along the axes of an arm whose axes are all parallel, are left out.
    """
    inverse = dict(zip(estimate.solution.joints.tolist(), estimate.solution.inverse.tolist(), strict=True))
    columns = tuple(
        inverse[j] * (joint_rows(problem, j).W_L[which] @ change) if j in inverse else None
        for j in range(problem.structure.arm.n)
    )
    size = np.sqrt(np.sum([np.sum(each**2, axis=0) for each in columns if each is not None], axis=0))
    shown = size > ROUNDING * size.max()

    def words(values: Array) -> str:
        each = np.full((len(values) // shown.sum(), len(shown)), np.nan)
        each[:, shown] = values.reshape(len(each), -1)
        return term.words(each.ravel())

    mounted = problem.payloads[which]
    return Direction(
        family=family, joints=(), logs=tuple(k for k, m in enumerate(problem.motions) if m.payload is mounted),
        columns=tuple(None if each is None else each[:, shown] for each in columns), term=replace(term, words=words),
        unit=unit, scale=scale, largest=np.inf, prior_std=np.array(prior_std)[shown] if any(prior_std) else None,
    )  # fmt: skip
