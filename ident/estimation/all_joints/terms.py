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
"""Share of the motor torque that friction is let take while a fit is on its way."""
MOTOR, LINKS = "load-motor", "load"
LOAD_FORMS = {
    MOTOR: "the motor torque",
    LINKS: "the torque of links and payload",
    "load-through": "the torque of links, payload and other friction",
}
"""What load friction may be in proportion to: what goes into gears, what comes out, or what they carry beside their own
loss. Of gears comes no torque that speeds up a rotor before them."""
OFFSET, ROTOR = "offset-share", "rotor-share"
"""Columns of two shares that load friction depends on: the part of a joint's offset that is no torque, unlike that of a
spring, and the part of a joint's inertia that is its rotor's, where data do not tell the two apart."""
SHARES = {OFFSET: Belief(0.5, 0.5), ROTOR: Belief(0.0, 0.5)}
"""What is believed of their coefficients: a share is from 0 to 1, and nothing else is known. Load friction itself has
all of the offset in it, and of the inertia the half that is assumed to be the rotor's."""
LOAD_MEAN, LOAD_STD = 0.05, 0.1
"""What is believed of load friction before joints have shown theirs: published drives lose 6 to 15 % of their torque.

Where friction dominates, a gain and its joint's load friction look the same, and a coefficient without bounds takes the
gain, and the torques that its column follows from, anywhere.
"""


@dataclass(frozen=True, slots=True, eq=False)
class TermColumns:
    """Columns of every joint by name.

    Attributes:
        own: Friction terms, n dicts of columns of shape (r_j,). Those of `LOAD_FORMS` have coefficients without unit,
            positive where friction brakes.
        shares: Those of the columns of `SHARES` that stand beside each of `LOAD_FORMS`, n dicts by form.
        softened: Change of torque per unit of each joint's compliance, as far as encoder noise lets it be seen, n
            arrays of shape (r_j, n), empty if not asked.
        torques: What the columns follow from, one a motion.
    """

    own: tuple[dict[str, Array], ...]
    shares: tuple[dict[str, dict[str, Array]], ...]
    softened: tuple[Array, ...]
    torques: tuple[Torques, ...]


@dataclass(frozen=True, slots=True)
class SpeedTerm:
    """A friction law in the speed: its function, and what it says."""

    law: Callable[[Array], Array]
    words: str


SPEED_TERMS = {
    "cbrt": SpeedTerm(np.cbrt, "viscous friction grows less than linearly with speed"),
    "by-direction": SpeedTerm(np.abs, "viscous friction differs between directions"),
}
"""Friction in the speed besides viscous and Coulomb, by name."""


def speed_terms(problem: Problem, laws: Iterable[str] = tuple(SPEED_TERMS)) -> tuple[dict[str, Term], ...]:
    """Friction terms of every joint that follow from the speed alone, by name; nothing is believed of them beforehand.

    Args:
        problem: Motions from recordings.
        laws: Which of `SPEED_TERMS`.
    """

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
    """Friction in proportion to torque, and what compliance does to the torques.

    Args:
        problem: Motions from recordings.
        shared: Which parameters joints share.
        own: Own columns of the earlier fit.
        fit: The earlier fit.
        compliance: Whether to take the derivative by the compliance of each joint.
        forms: Of `LOAD_FORMS`, those that are asked for.
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
            against = np.sign(fit.found.h[j] * behind.dq[:, j])  # of a drive wired backwards the currents are turned
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
    """Size of the current that friction is in proportion to, shape (N,): a motor's has that friction in it.

    Args:
        form: One of `LOAD_FORMS`.
        given: Current without that friction, shape (N,).
        c: Friction as a share of the motor's torque.
        against: Sign of the current against friction, shape (N,).
    """
    if form != MOTOR:
        return np.abs(given)
    return np.abs(given / (1.0 - np.clip(c, -STRONGEST, STRONGEST) * against * np.sign(given)))  # W = x + c |W| against


def _value(name: str, own: OwnColumns, phi: Array, otherwise: float) -> float:
    """Coefficient of a name that all motions have in common, or what stands for it where a fit has none."""
    return float(phi[own.names.index(name)]) if name in own.names else otherwise


def braking(dq: Array, own: OwnColumns, phi: Array, motion: int) -> Array:
    """Current against friction in the speed and an offset, shape (N,).

    Args:
        dq: Speed of the joint, shape (N,).
        own: Own columns of a fit.
        phi: Their values.
        motion: Place of the motion in the problem.
    """
    laws: dict[str, Callable[[Array], Array]] = {"Fv": np.positive, "Fc": np.sign, "off": np.ones_like}
    laws |= {name: term.law for name, term in SPEED_TERMS.items()}
    total = np.zeros_like(dq)
    for name, which, value in zip(own.names, own.motion, phi, strict=True):
        if name in laws and which in (-1, motion):
            total += value * laws[name](dq)
    return total


def of_rows(motion: ObservedMotion, change: Array, joint: int) -> Array:
    """Rows of what compliances or other errors do to the torque of a joint, shape (rows, m).

    Args:
        motion: From a recording.
        change: At full rate, joint before what changes its torque, shape (N, n, m).
        joint: The joint, from 0.
    """
    decimated = motion.observation.recorded.decimated(change[:, joint], joint)
    return decimated[motion.observation.joints[joint].position]
