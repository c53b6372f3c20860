"""The weight of a first experiment: one that is given, or a steel bar that the arm may and can carry, with the reason.

What an arm may carry is its rated load. Where nobody states one, it is taken for that of usual arms, and what is
heavier than the last link itself is warned of. What an arm can carry is what its joints hold: one that hardly holds
itself where it stretches out carries less, and moves calmly among the positions that it holds more easily.
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
"""Share of any joint's largest torque that the payload may ask for."""
TORQUE_SHARE = 0.75
"""Share of any joint's largest torque that arm and payload may ask for together; a search for a motion allows 0.8."""
CALMER = ((0.9, PACE), (0.6, 0.0), (0.3, 0.0), (0.1, 0.0))
"""Shares of random states that a payload leaves room for, and their pace, tried in this order: a search for a motion
keeps clear of the others."""
LEAST = 0.01
"""Least payload over the moving mass that is worth the next of these."""
HEAVIEST = 10.0
"""Largest payload [kg]."""


@dataclass(frozen=True, slots=True)
class Load:
    """A payload and why it is that one.

    Attributes:
        payload: The payload, complete.
        source: Where it comes from, a sentence.
        warning: What speaks against it, empty if nothing does.
        rated: Largest mass that the arm may carry [kg], None if nobody says.
    """

    payload: Payload
    source: str
    warning: str
    rated: float | None

    @property
    def body(self) -> PayloadBody:
        """What is mounted."""
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
    """The payload of a first experiment.

    Args:
        arm: The arm.
        model: Its model file.
        flange: Last body of the arm, None where all joints are its own.
        drives: Its drives.
        rated: Largest mass that the arm may carry [kg], None if nobody says.
        payload: A file that says what is mounted, or the mass of a bar [kg]; None for one that the arm can carry.

    Raises:
        RobotError: If the bare arm alone needs more than a joint's largest torque.
        PayloadError: If the file holds no payload.
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
        stated, source = read_payload(payload), f"as stated in {payload.name}"
        if stated.com is None or stated.inertia is None:
            raise PayloadError(f"{payload}: a simulation needs com and inertia of the payload; state both")
    return Load(stated, source, _warning(stated.mass, rated, own), rated)


def _allowed(rated: float | None, own: float, moving: float) -> tuple[float, str]:
    """Mass that an arm may carry [kg], and why."""
    if rated is not None:
        return min(rated, HEAVIEST), f"within the rated load of {rated:g} kg"
    usual = RATED * moving
    if own >= usual:
        return min(own, HEAVIEST), f"no rated load is stated, so at most the last link's own mass, {own:.2g} kg"
    words = f"no rated load is stated, so at most {100.0 * RATED:g} % of the moving links' mass, {usual:.2g} kg"
    return min(usual, HEAVIEST), f"{words}; data sheets state 8 to 30 %"


def _can_carry(
    arm: Arm, model: Path, flange: str | None, drives: Mapping[str, Stated], most: float, moving: float
) -> tuple[float, str]:
    """Mass up to `most` that leaves the joints room [kg], two digits; what keeps it below, empty if nothing does."""
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
        f"{mass:g} kg is more than the last link's own {own:.2g} kg, and no rated load is stated: look it up in the "
        "data sheet and state it with --rated-load"
    )
