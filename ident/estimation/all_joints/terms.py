"""Terms that follow from speed and from the torques of an earlier fit: friction laws, compliance."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.empirical_prior import Belief
from ident.estimation.all_joints.fit import AllJointsFit
from ident.estimation.all_joints.friction import OwnColumns, Term
from ident.estimation.all_joints.shown_band import without_encoder_noise
from ident.estimation.all_joints.torques import ROTOR_SHARE, Torques, rotor_inertia, told_rotors, torques
from ident.estimation.problem import ObservedMotion, Problem
from ident.support.arrays import Array

STRONGEST = 0.5
"""Largest share of friction in the motor torque during the iteration."""
MOTOR, LINKS = "load-motor", "load"
LOAD_FORMS = {
    MOTOR: "the motor torque",
    LINKS: "the torque of links and payload",
    "load-through": "the torque of links, payload and other friction",
}
"""Torques that load-dependent friction can be proportional to: at the input of the gears, at their output, or in the
gears without their loss. The torque that accelerates the rotor does not pass through the gears."""
OFFSET, ROTOR = "offset-share", "rotor-share"
"""Columns of two shares that load-dependent friction depends on: the part of a joint's offset that is not a torque,
unlike that of a spring, and the part of a joint's inertia that is the rotor's, if the data do not separate the two."""
SHARES = {OFFSET: Belief(0.5, 0.5), ROTOR: Belief(0.0, 0.5)}
"""Priors of their coefficients: a share is between 0 and 1, and nothing else is known. The column of load-dependent
friction includes all of the offset, and half of the inertia as the rotor's."""
LOAD_MEAN, LOAD_STD = 0.05, 0.1
"""Initial prior of load-dependent friction: published drives lose 6 to 15 % of their torque.

If friction dominates, the gain and the load-dependent friction of a joint are confounded; without a prior the
coefficient, the gain and the torques of its column would diverge.
"""


@dataclass(frozen=True, slots=True, eq=False)
class TermColumns:
    """Columns of every joint by name.

    Attributes:
        own: Friction terms, n dicts of columns of shape (r_j,). Those of `LOAD_FORMS` have coefficients without unit,
            positive where friction brakes.
        shares: The columns of `SHARES` that belong to each of `LOAD_FORMS`, n dicts by form.
        softened: Change of torque per unit of each joint's compliance, without frequencies dominated by encoder noise,
            n arrays of shape (r_j, n), empty if not requested.
        torques: The torques that the columns follow from, one per motion.
    """

    own: tuple[dict[str, Array], ...]
    shares: tuple[dict[str, dict[str, Array]], ...]
    softened: tuple[Array, ...]
    torques: tuple[Torques, ...]


@dataclass(frozen=True, slots=True)
class SpeedTerm:
    """A friction law of the speed: its function and its description."""

    law: Callable[[Array], Array]
    words: str


SPEED_TERMS = {
    "cbrt": SpeedTerm(np.cbrt, "viscous friction grows less than linearly with speed"),
    "by-direction": SpeedTerm(np.abs, "viscous friction differs between directions"),
}
"""Friction laws of the speed besides viscous and Coulomb friction, by name."""


def speed_terms(problem: Problem, laws: Iterable[str] = tuple(SPEED_TERMS)) -> tuple[dict[str, Term], ...]:
    """Return the friction terms of every joint that depend on the speed alone, by name, without priors."""

    def column(joint: int, law: Callable[[Array], Array]) -> Array:
        parts = list[Array]()
        for motion in problem.motions:
            behind = motion.observation.recorded
            kept = motion.observation.joints[joint].position
            parts.append(behind.decimated(law(behind.dq[:, joint]), joint)[kept])
        return np.concatenate(parts)

    return tuple(
        {name: Term(column(joint, SPEED_TERMS[name].law)) for name in laws} for joint in range(problem.structure.arm.n)
    )


def torque_terms(
    problem: Problem,
    shared: SharedParameters,
    own: Sequence[OwnColumns],
    fit: AllJointsFit,
    *,
    compliance: bool,
    forms: Collection[str] = tuple(LOAD_FORMS),
) -> TermColumns:
    """Return the columns of load-dependent friction, and of the effect of compliance on the torques.

    Args:
        problem: Motions from recordings.
        shared: The parameters that joints share.
        own: Own columns of the earlier fit.
        fit: The earlier fit.
        compliance: Whether to include the derivative by the compliance of each joint.
        forms: Names in `LOAD_FORMS`.
    """
    n = problem.structure.arm.n
    told = told_rotors(problem.structure)
    columns: list[dict[str, list[Array]]] = [{name: [] for name in forms} for _ in range(n)]
    shares: list[dict[str, dict[str, list[Array]]]] = [{name: defaultdict(list) for name in forms} for _ in range(n)]
    softened: list[list[Array]] = [[] for _ in range(n)]
    spun = rotor_inertia(problem, shared, fit.found.theta)
    along = tuple(torques(problem, motion, shared, fit.found.theta) for motion in problem.motions)
    for number, (motion, found) in enumerate(zip(problem.motions, along, strict=True)):
        behind = motion.observation.recorded
        if compliance:
            slow = without_encoder_noise(behind, found.softened(), found.inertia)
            for j, rows in enumerate(softened):
                rows.append(of_rows(motion, slow, j))
        for j in range(n) if forms else ():
            kept = motion.observation.joints[j].position
            against = np.sign(fit.found.h[j] * behind.dq[:, j])  # the current of a negative gain has the opposite sign
            rotor = fit.found.h[j] * spun[j] * behind.ddq[:, j]
            for name in forms:
                given, parts = fit.found.h[j] * found.rigid[:, j], dict[str, Array | float]()
                if name != LINKS:
                    given = given + braking(behind.dq[:, j], own[j], fit.phi[j], number)
                    parts[OFFSET] = _value("off", own[j], fit.phi[j], 0.0)
                if name != MOTOR:
                    given = given - rotor
                    if not told[j]:
                        parts[ROTOR] = rotor / ROTOR_SHARE
                c = _value(name, own[j], fit.phi[j], 0.0)
                load = _size(name, given, c, against)
                columns[j][name].append(behind.decimated(load * against, j)[kept])
                for share, part in parts.items():
                    less = (_size(name, given - part, c, against) - load) * against
                    change = _value(name, own[j], fit.phi[j], LOAD_MEAN) * less
                    shares[j][name][share].append(behind.decimated(change, j)[kept])
    return TermColumns(
        tuple({name: np.concatenate(parts) for name, parts in each.items()} for each in columns),
        tuple(
            {form: {name: np.concatenate(parts) for name, parts in own.items()} for form, own in each.items()}
            for each in shares
        ),
        tuple(np.vstack(each) for each in softened) if compliance else (),
        along,
    )


def _size(form: str, given: Array, c: float, against: Array) -> Array:
    """Magnitude of the current that friction is proportional to, shape (N,); that of the motor includes this friction.

    Args:
        form: One of `LOAD_FORMS`.
        given: Current without that friction, shape (N,).
        c: Friction as a share of the motor's torque.
        against: Sign of the current that opposes friction, shape (N,).
    """
    if form != MOTOR:
        return np.abs(given)
    return np.abs(given / (1.0 - np.clip(c, -STRONGEST, STRONGEST) * against * np.sign(given)))  # W = x + c |W| against


def _value(name: str, own: OwnColumns, phi: Array, otherwise: float) -> float:
    """Coefficient with a name that is common to all motions, or a default if the fit has none."""
    return float(phi[own.names.index(name)]) if name in own.names else otherwise


def braking(dq: Array, own: OwnColumns, phi: Array, motion: int) -> Array:
    """Return the current of speed-dependent friction and offset, shape (N,).

    Args:
        dq: Speed of the joint, shape (N,).
        own: Own columns of a fit.
        phi: Their values.
        motion: Index of the motion in the problem.
    """
    laws: dict[str, Callable[[Array], Array]] = {"Fv": np.positive, "Fc": np.sign, "off": np.ones_like}
    laws |= {name: term.law for name, term in SPEED_TERMS.items()}
    total = np.zeros_like(dq)
    for name, which, value in zip(own.names, own.motion, phi, strict=True):
        if name in laws and which in (-1, motion):
            total += value * laws[name](dq)
    return total


def of_rows(motion: ObservedMotion, change: Array, joint: int) -> Array:
    """Return the rows of the effect of compliances or other errors on the torque of a joint, shape (rows, m).

    Args:
        motion: From a recording.
        change: The effect on each joint at full rate, shape (N, n, m).
        joint: The joint, from 0.
    """
    decimated = motion.observation.recorded.decimated(change[:, joint], joint)
    return decimated[motion.observation.joints[joint].position]
