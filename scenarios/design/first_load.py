"""The payload of a first experiment: a given one, or a steel bar within rated load and joint torques, with the reason.

Without a stated rated load, that of usual arms is assumed, and a warning is given for a payload heavier than the last
link. The torques of the joints limit the payload too: a weak arm gets a lighter one, and moves slowly among positions
that need less torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.payload.files import read_payload
from ident.payload.payload import Payload
from ident.support.errors import PayloadError
from scenarios.design.rules_of_thumb import PACE, RATED, Stated, bar, beside_the_axis, random_torques
from scenarios.experiments.build import body_of
from sim.compile import bare_arm
from sim.errors import RobotError
from sim.plant import PayloadBody

LOADED = 0.3
"""Largest torque of the payload, as a share of any joint's largest torque."""
TORQUE_SHARE = 0.75
"""Largest torque of arm and payload, as a share of any joint's largest torque; the search for a motion allows 0.8."""
CALMER = ((0.9, PACE), (0.6, 0.0), (0.3, 0.0), (0.1, 0.0))
"""Shares of random states that must be feasible, and their relative speeds, tried in this order."""
LEAST = 0.01
"""Smallest ratio of payload to moving mass before the next of these is tried."""
HEAVIEST = 10.0
"""Largest payload [kg]."""


@dataclass(frozen=True, slots=True)
class Load:
    """A payload with its origin.

    Attributes:
        payload: The payload, complete.
        source: Origin of the payload, a sentence.
        warning: Warning, empty if there is none.
        rated: Rated load [kg], None if not stated.
    """

    payload: Payload
    source: str
    warning: str
    rated: float | None

    @property
    def body(self) -> PayloadBody:
        """The payload as a rigid body."""
        return body_of(self.payload)


def first_load(
    arm: Arm,
    model: Path,
    flange: str | None,
    drives: Mapping[str, Stated],
    *,
    rated: float | None = None,
    payload: Path | float | None = None,
) -> Load:
    """Return the payload of a first experiment.

    Args:
        arm: The arm.
        model: Its model file.
        flange: Last body of the arm, None if all joints belong to the arm.
        drives: Its drives.
        rated: Rated load [kg], None if not stated.
        payload: A payload file, or the mass of a bar [kg]; None for a bar that the arm can carry.

    Raises:
        RobotError: If the bare arm alone needs more than a joint's largest torque.
        PayloadError: If the file is not a payload file.
    """
    compiled, com = bare_arm(model, np.zeros(arm.n), flange), beside_the_axis(arm)
    own, moving = (float(compiled.body_subtreemass[compiled.jnt_bodyid[j]]) for j in (-1, 0))
    if payload is None:
        most, why = _allowed(rated, own, moving)
        can, weakest = _can_carry(arm, model, flange, drives, most, moving)
        stated = bar(can, com)
        source = f"assumed: a steel bar of proportions 1 : 1 : 3 beside the axis of the last joint; {weakest or why}"
    elif not isinstance(payload, Path):
        stated, source = bar(payload, com), "a steel bar of proportions 1 : 1 : 3 of the mass that was given"
    else:
        stated, source = read_payload(payload), f"as specified in {payload.name}"
        if stated.com is None or stated.inertia is None:
            raise PayloadError(f"{payload}: a simulation needs com and inertia of the payload; state both")
    return Load(stated, source, _warning(stated.mass, rated, own), rated)


def _allowed(rated: float | None, own: float, moving: float) -> tuple[float, str]:
    """Return the largest allowed mass [kg], and the reason."""
    if rated is not None:
        return min(rated, HEAVIEST), f"within the rated load of {rated:g} kg"
    usual = RATED * moving
    if own >= usual:
        return min(own, HEAVIEST), f"no rated load is specified, so at most the last link's own mass, {own:.2g} kg"
    words = f"no rated load is specified, so at most {100.0 * RATED:g} % of the moving links' mass, {usual:.2g} kg"
    return min(usual, HEAVIEST), f"{words}; data sheets state 8 to 30 %"


def _can_carry(
    arm: Arm, model: Path, flange: str | None, drives: Mapping[str, Stated], most: float, moving: float
) -> tuple[float, str]:
    """Return the largest mass up to `most` within the joint torques [kg], and what limits it or an empty text."""
    torque, speed, com = drives["current_limit"].value, drives["max_velocity"].value, beside_the_axis(arm)
    need = room = np.zeros(arm.n)
    for share, pace in CALMER:
        bare, loaded = (
            random_torques(arm, model, flange, speed, load, pace=pace) for load in (None, body_of(bar(1.0, com)))
        )
        need, each = np.quantile(np.abs(bare), share, axis=0), np.abs(loaded - bare).max(axis=0)
        room = np.minimum(LOADED * torque, TORQUE_SHARE * torque - need)
        masses = room / np.maximum(each, 1e-9)
        mass = min(most, float(masses.min()))
        if mass >= min(most, LEAST * moving):
            digits = 10.0 ** (np.floor(np.log10(mass)) - 1.0)
            weakest = f"the largest mass that the torque of joint {arm.joint_names[int(masses.argmin())]} can hold"
            return float(f"{np.floor(mass / digits + 1e-9) * digits:.2g}"), weakest if mass < most else ""
    j = int(np.argmin(room / torque))
    raise RobotError(
        f"robot model {model}: joint {arm.joint_names[j]}: its largest torque is {torque[j]:.3g}, holding the bare arm "
        f"takes {need[j]:.3g} or more at {100.0 * (1.0 - CALMER[-1][0]):.0f} % of its positions; correct its effort or "
        "force range, or the masses of the links, or state the torques of all joints with --torque"
    )


def _warning(mass: float, rated: float | None, own: float) -> str:
    if rated is not None:
        return f"{mass:g} kg is above the rated load, {rated:g} kg" if mass > rated else ""
    if mass <= 1.005 * own:
        return ""
    return (
        f"{mass:g} kg is more than the last link's own {own:.2g} kg, and no rated load is specified: look it up in the "
        "data sheet and state it with --rated-load"
    )
