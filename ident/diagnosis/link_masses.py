"""Check of the common scale of all gains by the link masses of the model; no gain depends on it.

With the gain g_j of a joint, its bare currents are a torque g_j V_j, of which the links of the model explain k_j times
their own torque:

    g_j V_j = k_j W_j chi_drawn + Ia ddq_j + Fv dq_j + Fc sign(dq_j) + off        W_j  (r, p)  rows of joint j

Gains, and thus every k_j, are proportional to the payload's mass. The inertia of a rotor, which a model hardly ever
states, is free also where it is regrouped with that of links; otherwise it makes links look heavier. For real arms,
data-sheet masses were correct within a third.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.parameters import COUPLING, INERTIAL, STANDARD
from ident.numerics.least_squares import column_space
from ident.support.arrays import Array
from ident.support.naming import joint_list

SHOWN = 0.7
"""Smallest share that the links of the model explain of the squared torque not explained by motor and friction.

Links with other proportions than the arm's, such as placeholders, explain less.
"""
FACTOR = 1.4
"""Factor, or its inverse, beyond which masses are reported; with correct payloads real arms reached 1.26, simulated
ones 1.04."""
LEAST = 2
"""Smallest number of joints: a spring or a wrong gain biases a single one."""
OTHER_UNIT = 1000.0**0.5
"""Factor, or its inverse, from which another unit, such as grams for kilograms, is the likeliest explanation.

Densities of materials differ by less: links modelled as water and made of steel are 8 times as heavy.
"""
ALIKE = 1e-6
"""Relative difference below which masses are equal, as of a placeholder."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkWeight:
    """Ratio of a joint's bare torque, by its gain, to that of the links of the model.

    Attributes:
        joint: The joint, from 0.
        factor: k.
        share: Share that the links explain of the squared torque not explained by motor and friction.
    """

    joint: int
    factor: float
    share: float


def link_mass_consistency(problem: Problem, estimate: GainEstimate, links: Array) -> Diagnosis | None:
    """Check whether link masses by the gains agree with those of the model.

    Args:
        problem: Motions and payloads.
        estimate: Gains estimated from them.
        links: Standard parameters of every link of the model, with all bodies fixed to it, shape (n, 10).

    Returns:
        The diagnosis; None if masses are placeholders, no motion is bare, or too few joints have a factor.
    """
    gains = {j: each.value for j, each in enumerate(estimate.joints) if isinstance(each, IdentifiedGain)}
    found = link_mass_factor(problem.motions, gains, links)
    if found is None or found.value is None or 1.0 / OTHER_UNIT < found.value < OTHER_UNIT:
        return found
    masses = dict.fromkeys(f"{each.payload.mass:g} kg" for each in problem.motions if each.payload is not None)
    return replace(
        found,
        severity=Severity.WRONG,
        sentence=f"payload mass {' and '.join(masses)}: {found.sentence}; the unit of either is wrong",
        advice="state the payload's mass in kg; if the model's masses are placeholders, give all links the same",
        joints=tuple(range(problem.structure.arm.n)),
    )


def judged(found: Sequence[LinkWeight]) -> Diagnosis | None:
    """Return a diagnosis of the factors of enough joints: weak if more than half exceed `FACTOR` in one direction."""
    shown = [each for each in found if each.share >= SHOWN]
    if len(shown) < LEAST:
        return None
    factors = sorted(each.factor for each in shown)
    low, high = factors[(len(factors) - 1) // 2], factors[len(factors) // 2]  # both are equal for an odd number
    if low <= 0.0:
        return None
    off, median = max(low, 1.0 / high) > FACTOR, 0.5 * (low + high)
    joints = [each.joint for each in shown]
    return Diagnosis(
        name="link masses",
        severity=Severity.WEAK if off else Severity.GOOD,
        sentence=(
            f"with these gains the arm's masses are {two_digits(median)} times those of its model (median of "
            f"{joint_list(joints)}, bare motions)"
        ),
        advice="check the payload's mass, and the masses of the model" if off else None,
        joints=tuple(joints),
        value=median,
        unit="times",
    )


def link_mass_factor(motions: Sequence[ObservedMotion], gains: Mapping[int, float], links: Array) -> Diagnosis | None:
    """Return the diagnosis of gains, by joint from 0, on bare motions; None if masses are placeholders."""
    mass = links[:, INERTIAL.index("M")]
    alike = bool(np.ptp(mass) <= ALIKE * float(np.abs(mass).max()))
    return None if alike else judged(link_weights(motions, gains, links))


def link_weights(motions: Sequence[ObservedMotion], gains: Mapping[int, float], links: Array) -> tuple[LinkWeight, ...]:
    """Return the factor of every joint with a gain and a load by its links, from the bare motions.

    Args:
        motions: Motions, of which the bare ones are used.
        gains: Gains, by joint from 0.
        links: As in `link_mass_consistency`.
    """
    bare, found = [each.observation for each in motions if each.payload is None], list[LinkWeight]()
    for joint, gain in gains.items() if bare else ():
        base, rows = bare[0].structure.base, [each.joints[joint] for each in bare]
        K = base.regrouping[rows[0].columns]
        W, V = np.vstack([each.W for each in rows]), np.concatenate([each.V for each in rows])
        own = [f"{name}{joint + 1}" for name in STANDARD[len(INERTIAL) :]]
        beside = [k for k, name in enumerate(base.labels) if name in own or name.rstrip("0123456789") in COUPLING]
        Q = column_space(W @ K[:, beside])
        torque, drawn = (each - Q @ (Q.T @ each) for each in (gain * V, W @ (K @ base.standard(links))))
        size, whole = float(drawn @ drawn), float(torque @ torque)
        if size > ALIKE**2 * whole:
            factor = float(drawn @ torque) / size
            found.append(LinkWeight(joint=joint, factor=factor, share=factor**2 * size / whole))
    return tuple(found)
