"""Terms that follow from speed and from the torques of an earlier fit: friction laws, compliance."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import SharedParameters
from ident.estimation.all_joints.fit import AllJointsFit
from ident.estimation.all_joints.friction import OwnColumns, Term
from ident.estimation.all_joints.shown_band import without_encoder_noise
from ident.estimation.all_joints.torques import Torques, rotor_inertia, torques
from ident.estimation.problem import ObservedMotion, Problem
from ident.support.arrays import Array

STRONGEST = 0.5
"""Share of the motor torque that friction is let take while a fit is on its way."""
MOTOR = "load-motor"
LOAD_FORMS = {
    MOTOR: "the motor torque",
    "load": "the torque of links and payload",
    "load-through": "the torque of links, payload and other friction",
}
"""What load friction may be in proportion to: what goes into gears, what comes out, or what they carry beside their own
loss. Of gears comes no torque that speeds up a rotor before them."""
AMPLIFIER = "amplifier"
"""Column of the share of a joint's offset that is its amplifier's: no torque, from which friction could follow as from
that of a spring."""
AMPLIFIER_MEAN, AMPLIFIER_STD = 0.5, 0.5
"""What is believed of the share: it is from 0 to 1, and nothing else is known."""
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
            positive where friction brakes; `AMPLIFIER` stands beside that of the motor.
        softened: Change of torque per unit of each joint's compliance, as far as encoder noise lets it be seen, n
            arrays of shape (r_j, n), empty if not asked.
        torques: What the columns follow from, one a motion.
    """

    own: tuple[dict[str, Array], ...]
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
    motors = (AMPLIFIER,) if MOTOR in forms else ()
    columns: list[dict[str, list[Array]]] = [{name: [] for name in (*forms, *motors)} for _ in range(n)]
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
            links = fit.found.h[j] * found.rigid[:, j] - rotor
            for name in forms:
                current = links
                if name != "load":
                    current = links + braking(behind.dq[:, j], own[j], fit.phi[j], number)
                load = np.abs(current)
                if name == MOTOR:
                    c, offset = (_value(each, own[j], fit.phi[j], 0.0) for each in (MOTOR, "off"))
                    load, less = (_of_motor(current + rotor - each, c, against) for each in (0.0, offset))
                    change = _value(MOTOR, own[j], fit.phi[j], LOAD_MEAN) * (less - load) * against
                    columns[j][AMPLIFIER].append(behind.decimated(change, j)[kept])
                columns[j][name].append(behind.decimated(load * against, j)[kept])
    return TermColumns(
        tuple({name: np.concatenate(parts) for name, parts in each.items()} for each in columns),
        tuple(np.vstack(each) for each in softened) if compliance else (),
        along,
    )


def _of_motor(given: Array, c: float, against: Array) -> Array:
    """Size of the current that gives a motor's torque, friction in proportion to it included, shape (N,).

    Args:
        given: Current without that friction, shape (N,).
        c: Friction as a share of the motor's torque.
        against: Sign of the current against friction, shape (N,).
    """
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
