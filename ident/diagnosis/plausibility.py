"""Checks for gross mistakes: degrees instead of radians, the same file twice, swapped files, no load.

Each raises an error with the likely mistake and the remedy, before or after an estimate that would otherwise look
valid. Fits of each joint alone also give the sign of its friction, and the accuracy of its gain with a planned payload.

If friction drives instead of braking, positions or currents have the wrong sign. The gain, in drive units, has the sign
of the friction; a negative one is not necessarily a mistake. For a planned payload, the rows of the log represent both
motions, without and with it. The standard deviation of 1/g follows from the columns (paper, eq. 20) and the residual:
that of a joint's own fit, but at least that of real drives. An approximate gain converts it to a relative one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, finding
from ident.diagnosis.hypothesis import SLACK, reach
from ident.estimation.estimate import FRICTION_Z, GainEstimate, joint_signs, largest
from ident.estimation.intervals import Basis, Rows, max_of_classical_and_jackknife, rms
from ident.estimation.joint_by_joint import joint_by_joint_gains, joint_fit
from ident.estimation.problem import GainOptions, ObservedMotion, Problem, joint_rows, pair
from ident.model.arm import Arm
from ident.numerics.least_squares import least_squares
from ident.observation.observation import Observation
from ident.payload.payload import Payload
from ident.recordings.description import STATE, line_of
from ident.recordings.recording import NO_JOINT, Motion, Recording, share_samples
from ident.support.arrays import Array, readonly
from ident.support.errors import IdentificationError, NotIdentifiable, RecordingError

LOAD_Z = 4.0
"""Number of standard deviations by which 1/g must differ from zero on some joint for a load to be present."""
RECORD_BARE = "record one with nothing on the flange (--unloaded)"
SWAPPED = "every joint gives a negative payload mass; bare and loaded recordings are probably swapped"
RANK_TOL = 1e-9
"""Smallest singular value of unit columns, relative to the largest."""
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
    motors = f"of the motor's side: add {STATE} 'q.factor = [..]', 1 / ratio of each joint"
    return f"check model (logs of another robot?), zeros and units; {motors}"


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
    """Whether all loads of an estimate with gains are negative for gains of the sign of friction: files are swapped.

    Without significant friction on any joint with a load, gains are taken as positive.
    """
    signs = joint_signs(estimate)
    seen, braked = np.abs(signs.load_z) > LOAD_Z, np.abs(signs.friction_z) > FRICTION_Z
    told = seen & braked if (seen & braked).any() else seen
    sign = np.where(braked, np.sign(signs.friction_z), 1.0)
    return bool(estimate.identified and told.any() and not (signs.load_z * sign > 0.0)[told].any())


def prediction_warnings(shares: Mapping[int, float]) -> tuple[str, ...]:
    """Return a warning for every joint, from 0, with a large prediction error relative to the currents."""
    return tuple(
        f"joint {joint + 1}: the current is predicted with an error of {100.0 * share:.0f} % (good recordings: "
        "up to 10 %), so the model is wrong and the results of this joint are invalid; check coupling "
        "(--coupling), friction, sign, column and base"
        for joint, share in shares.items()
        if share > LARGE_RESIDUAL
    )


def friction_z(problem: Problem, joint: int) -> Array:
    """Return total and Coulomb friction of a joint over their standard deviations, shape (2,); 0 with too few rows."""
    rows = joint_rows(problem, joint)
    size = np.linalg.norm(rows.W, axis=0)
    U, s, Vt = np.linalg.svd(rows.W / np.where(size > 0.0, size, 1.0), full_matrices=False)
    rank = int(np.sum(s > RANK_TOL * s.max(initial=0.0)))
    if len(rows.V) <= rank:
        return np.zeros(2)
    Q, kinds = U[:, :rank], np.array((rows.of_parameter("Fv", "Fc"), rows.of_parameter("Fc")), dtype=np.float64)
    influence = readonly(kinds @ (Vt[:rank].T / s[:rank]) @ Q.T)  # at typical speed; dependent columns share equally
    fitted = Rows(
        V=rows.V, residual=rows.V - Q @ (Q.T @ rows.V), joint=rows.joint, motion=rows.motion,
        position=rows.position, unknowns={joint: float(rank)}, weight=np.ones(len(rows.V)), explained=Basis.of(Q),
    )  # fmt: skip
    std = np.sqrt(np.diag(max_of_classical_and_jackknife(fitted, influence)))
    return np.divide(influence @ rows.V, std, out=np.zeros(2), where=std > 0.0)


def friction_sign(problems: Sequence[Problem], about: Array | None) -> list[Diagnosis]:
    """Return the diagnosis of joints that friction drives and never brakes, for gains `about`, (n,), or positive."""
    n, found = problems[0].structure.arm.n, list[Diagnosis]()
    for j, sign in enumerate(np.ones(n) if about is None else np.sign(about)):
        z = [sign * float(largest(friction_z(problem, j))) for problem in problems]
        if min(z) < -FRICTION_Z and max(z) < FRICTION_Z:
            sentence = f"friction of joint {j + 1} has the sign of a driving torque: v{j + 1} and q{j + 1} have "
            advice = f"negate q{j + 1} or v{j + 1}, whichever contradicts the model; otherwise the gain is negative"
            found.append(finding(None, "friction sign", sentence + "opposite signs", advice, joints=(j,)))
    good = "friction opposes the motion of every joint where it is identifiable"
    return found or [finding(None, "friction sign", good)]


def opposed(problem: Problem, joints: Sequence[int]) -> list[tuple[int, int]]:
    """Those of some joints, from 0, that friction brakes in one log and drives in another, with the faulty log.

    It is the one with the less frequent sign, of two the later one. An unknown payload of negative mass could explain
    a negated current of a vertical prismatic joint; friction cannot be explained so.
    """
    motions = [replace(problem, motions=(each,)) for each in problem.motions]
    found = list[tuple[int, int]]()
    for joint in joints:
        z = np.array([largest(friction_z(each, joint)) for each in motions])
        if z.max() > FRICTION_Z and z.min() < -FRICTION_Z:
            brakes, drives = np.flatnonzero(z > FRICTION_Z), np.flatnonzero(z < -FRICTION_Z)
            found.append((joint, int(min(brakes, drives, key=lambda logs: (len(logs), -logs[-1]))[-1])))
    return found


def predicted_rel_std(
    observation: Observation, payload: Payload, gain: Array, options: GainOptions
) -> tuple[float | None, ...]:
    """Predict the relative standard deviation of gains (n,) [N m / unit] with a payload; None if not identifiable."""
    twice = pair(observation, observation, payload, options)
    alone = Problem(observation.structure, (ObservedMotion(observation, None),), options)

    def predicted(joint: int) -> float | None:
        both, rows = joint_fit(twice, joint, [payload.known_part()]), joint_rows(alone, joint)
        if isinstance(both, str):
            return None
        own = least_squares(rows.W, rows.V, rank_tol=RANK_TOL)
        sigma = max(own.sigma, options.noise_floor * rms(rows.V))
        return sigma * float(np.sqrt(both.fit.cofactor[-1, -1])) * abs(float(gain[joint]))  # std(g) / g = g std(1/g)

    return tuple(predicted(joint) for joint in range(observation.structure.arm.n))


def excitation(log: str, predicted: tuple[float | None, ...], options: GainOptions) -> Diagnosis:
    """Return the diagnosis of the gains that motion and payload would identify."""
    unseen = [j for j, std in enumerate(predicted) if std is None or std > options.max_rel_std]
    words = ", ".join("-" if std is None else f"{100.0 * std:.2g}" for std in predicted)
    listed = ", ".join(str(j + 1) for j in unseen)
    advice = f"for joint {listed}, mount the payload farther from its axis, or a heavier one" if unseen else None
    sentence = f"predicted standard deviations of the gains, joint by joint: {words} %"
    return finding(log, "excitation", sentence, advice, joints=unseen)
