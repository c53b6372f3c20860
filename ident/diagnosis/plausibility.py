"""Checks for gross mistakes: degrees instead of radians, the same file twice, swapped files, no load.

Each raises an error with the likely mistake and the remedy, before or after an estimate that would otherwise look
valid.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ident.diagnosis.hypothesis import SLACK, reach
from ident.estimation.estimate import FRICTION_Z, GainEstimate, joint_signs
from ident.estimation.joint_by_joint import joint_by_joint_gains
from ident.estimation.problem import Problem
from ident.model.arm import Arm
from ident.recordings.description import STATE, line_of
from ident.recordings.recording import NO_JOINT, Motion, Recording, share_samples
from ident.support.errors import IdentificationError, NotIdentifiable, RecordingError

LOAD_Z = 4.0
"""Number of standard deviations by which 1/g must differ from zero on some joint for a load to be present."""
RECORD_BARE = "record one with nothing on the flange (--unloaded)"
SWAPPED = "every joint gives a negative payload mass; bare and loaded recordings are probably swapped"
LARGE_RESIDUAL = 0.15
"""Share of a joint's current above which its residual is reported."""


def check_joints(arm: Arm, recording: Recording) -> None:
    """Refuse a recording with another number of joints than the arm, by `RecordingError`."""
    if recording.n != arm.n:
        raise RecordingError(
            f"{recording.name}: {recording.n} joints, but robot {arm.name} has {arm.n}; check the model or the columns"
            f"{NO_JOINT if recording.n > arm.n else ''}"
        )


def check_positions(arm: Arm, recording: Recording) -> None:
    """Refuse positions beyond the limits of the arm, by `RecordingError`, and report if they look like degrees."""
    check_joints(arm, recording)
    lowest, highest = recording.q.min(axis=0), recording.q.max(axis=0)

    def beyond(unit: float) -> list[int]:
        ends = [(j, *reach(arm, j)) for j in np.flatnonzero(arm.revolute).tolist()]
        return [j for j, least, most in ends if unit * lowest[j] < least - SLACK or unit * highest[j] > most + SLACK]

    for j in beyond(1.0)[:1]:
        (lower, upper), low, high = reach(arm, j), float(lowest[j]), float(highest[j])
        degrees = not beyond(np.deg2rad(1.0)) and max(-low, high) > 2.0 * np.pi
        like_degrees = f"the log looks like degrees; add {line_of('q.factor', [np.deg2rad(1.0)])}"
        raise RecordingError(
            f"{recording.name}: q{j + 1} runs from {low:.4g} to {high:.4g}, outside the range {lower:.4g} to "
            f"{upper:.4g} rad of {arm.joint_names[j]}; {like_degrees if degrees else advice_on_units(recording)}"
        )


def advice_on_units(recording: Recording) -> str:
    """What to do about positions beyond the limits, if no one unit of all joints explains them."""
    if (recording.q == np.rint(recording.q)).all():
        lines = f"{STATE} 'q.unit = \"ticks\"' 'q.counts_per_turn = [..]'"
        return f"all are whole numbers, as counts of encoders: add {lines}, per turn of each joint"
    return f"check model, zeros and units; of the motor's side: add {STATE} 'q.factor = [..]', 1 / ratio of each joint"


def check_different(recordings: Sequence[Recording]) -> None:
    """Refuse, by `NotIdentifiable`, two recordings with the same samples, even in part: they would count twice."""
    for first, second in combinations(recordings, 2):
        if share_samples(first, second):
            raise NotIdentifiable(
                f"{first.name} and {second.name} contain the same motion, fully or partly; record each motion anew"
            )


def check_payloads(motions: Sequence[Motion]) -> None:
    """Refuse, by `NotIdentifiable`, motions that all carry one payload: nothing tells it from the last link."""
    payloads = [each.payload for each in motions]
    if payloads[0] is None or any(each != payloads[0] for each in payloads):
        return
    names = list(dict.fromkeys(each.recording.name for each in motions))
    carry = f"{' and '.join(names)} carry" if len(names) > 1 else f"{names[0]} carries"
    raise NotIdentifiable(
        f"{carry} the same payload of {payloads[0].mass:g} kg, and no log is bare: a gain needs motions with and "
        "without it; give the log of the bare flange with --unloaded, or record one"
    )


def check_load(estimate: GainEstimate, *, bare: bool = True) -> None:
    """Refuse, by `NotIdentifiable`, an estimate without a load, without gains, or with a negative load (swapped)."""
    load_z = joint_signs(estimate).load_z
    if len(load_z) and not (np.abs(load_z) > LOAD_Z).any():
        if not bare:
            raise NotIdentifiable(f"without a bare motion the torque of the payload is not identifiable: {RECORD_BARE}")
        raise NotIdentifiable(f"{estimate.method} finds no torque of the payload on any joint; was it mounted?")
    if not estimate.identified:
        reason = f"joint 1: {estimate.reasons[0]}"
        if not bare:
            raise NotIdentifiable(f"no drive gain can be identified without a bare motion: {RECORD_BARE}; {reason}")
        raise NotIdentifiable(f"no drive gain can be identified; {reason}; was the payload mounted?")
    if swapped(estimate):
        raise NotIdentifiable(SWAPPED)


def cause_of(error: IdentificationError, problem: Problem) -> IdentificationError:
    """Return the cause of a failed estimate: swapped files if the linear method detects these, else the error."""
    try:
        return NotIdentifiable(SWAPPED) if swapped(joint_by_joint_gains(problem)) else error
    except IdentificationError:
        return error


def swapped(estimate: GainEstimate) -> bool:
    """Whether all loads of an estimate with gains are negative for gains of the sign of friction: files are swapped."""
    signs = joint_signs(estimate)
    seen = np.abs(signs.load_z) > LOAD_Z
    sign = np.where(np.abs(signs.friction_z) > FRICTION_Z, np.sign(signs.friction_z), 1.0)
    return bool(estimate.identified and seen.any() and not (signs.load_z * sign > 0.0)[seen].any())


def prediction_warnings(shares: Mapping[int, float]) -> tuple[str, ...]:
    """Return a warning for every joint, from 0, with a large prediction error relative to the currents."""
    return tuple(
        f"joint {joint + 1}: the current is predicted with an error of {100.0 * share:.0f} % (good recordings: "
        "up to 10 %), so the model is wrong and the results of this joint are invalid; check coupling "
        "(--coupling), friction, sign, column and base"
        for joint, share in shares.items()
        if share > LARGE_RESIDUAL
    )
