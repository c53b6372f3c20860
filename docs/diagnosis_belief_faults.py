"""Faults of specified values: base and lengths of the model, the payload, swapped files, the kind of current."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pinocchio as pin
from diagnosis_cases import PINOCCHIO, SoundCase
from diagnosis_fault import Fault, Motions, Samples, all_joints, all_logs, believed, modelled, number
from diagnosis_simulator import built, with_payload
from scipy import signal, spatial

from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Array


def _with_gravity(structure: Structure, gravity: Array) -> Structure:
    return structure_of(replace(structure.arm, gravity=gravity))


def models(case: SoundCase) -> Iterator[Fault]:
    arm, every, joints = case.structure.arm, all_logs(case), all_joints(case)
    down = arm.gravity / np.linalg.norm(arm.gravity)
    side = np.cross(down, (0.3, 0.8, 0.52) if abs(down[2]) > 0.5 else (0.3, 0.2, 0.93))
    side /= np.linalg.norm(side)
    for words, degrees, kind in (
        ("on its side", 90.0, "base"), ("upside down", 180.0, "base"), ("on its other side", -90.0, "base"),
        ("tilted", 2.0, "base tilted"), ("tilted", -5.0, "base tilted"), ("tilted", 15.0, "base tilted"),
    ):  # fmt: skip
        turn = spatial.transform.Rotation.from_rotvec(np.deg2rad(degrees) * side)
        apply = modelled(lambda s, turn=turn: _with_gravity(s, turn.as_matrix() @ s.arm.gravity))
        yield Fault(
            kind,
            f"model's gravity {words} by {degrees:+g} degrees",
            joints,
            every,
            float(np.deg2rad(degrees)),
            "rad",
            apply,
        )
    for factor in (0.8, 0.95, 1.25):
        apply = modelled(lambda s, factor=factor: structure_of(replace(s.arm, translation=factor * s.arm.translation)))
        yield Fault("all lengths", f"model's lengths times {factor:g}", joints, every, factor, "", apply)
    lengths = np.linalg.norm(arm.translation, axis=1)
    longest = [j for j in np.argsort(-lengths).tolist() if j > 0]
    for k, factor in enumerate((0.9, 1.25, 1.05)):
        j = longest[k % min(2, len(longest))]
        scaled = np.where(np.arange(arm.n)[:, None] == j, factor, 1.0)
        apply = modelled(lambda s, scaled=scaled: structure_of(replace(s.arm, translation=scaled * s.arm.translation)))
        words = f"model's place of joint {number(j)} times {factor:g}"
        yield Fault("one length", words, (j,), every, factor, "", apply)


def payload_faults(case: SoundCase) -> Iterator[Fault]:
    carried = next((each.payload for each in case.motions if each.payload is not None), None)
    if carried is None or all(each.payload is not None for each in case.motions):
        return
    joints = all_joints(case)
    loaded = tuple(k for k, each in enumerate(case.motions) if each.payload is not None)
    for factor in (2.0, 0.5, 10.0, 1.05):

        def heavier(p: Payload, factor: float = factor) -> Payload:
            inertia = None if p.inertia is None else _six(factor * np.array(p.inertia))
            return replace(p, mass=factor * p.mass, inertia=inertia)

        words = f"stated mass times {factor:g}"
        yield Fault("mass of the payload", words, joints, loaded, factor, "", believed(heavier))  # scales all gains
    if carried.known == "all" and carried.com is not None and carried.inertia is not None:
        yield from _known_payload(carried, joints, loaded)
    swapped = lambda motions, structure: (  # noqa: E731
        tuple(
            replace(each, recording=motions[k].recording)
            for each, k in zip(motions, _exchanged(loaded, len(motions)), strict=True)
        ),
        structure,
    )
    yield Fault("logs swapped", "bare and loaded files exchanged", joints, all_logs(case), None, "", swapped)
    for k, kept in enumerate((0, loaded[0])):

        def same(motions: Motions, structure: Structure, kept: int = kept) -> tuple[Motions, Structure]:
            return tuple(replace(each, recording=motions[kept].recording) for each in motions), structure

        yield Fault("same file twice", f"{('bare', 'loaded')[k]} file for all", joints, all_logs(case), None, "", same)
    if case.spec.source == PINOCCHIO:
        yield from _unmounted(case, joints, loaded)


def _known_payload(carried: Payload, joints: tuple[int, ...], loaded: tuple[int, ...]) -> Iterator[Fault]:
    """Mistakes of centre, inertia and frame of a fully specified payload."""
    direction = np.array([0.64, -0.48, 0.6])
    for distance in (0.01, 0.02, 0.05):
        apply = believed(lambda p, d=distance: replace(p, com=_three(np.array(p.com) + d * direction)))
        words = f"stated centre {100 * distance:g} cm off"
        yield Fault("centre of the payload", words, joints, loaded, distance, "m", apply)
    for factor in (3.0, 0.33):
        apply = believed(lambda p, f=factor: replace(p, inertia=_six(f * np.array(p.inertia))))
        words = f"stated inertia times {factor:g}"
        yield Fault("inertia of the payload", words, joints, loaded, factor, "", apply)
    for axis, degrees in (("z", 90.0), ("x", 180.0), ("y", 90.0)):
        turn = spatial.transform.Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
        words = f"turned by {degrees:g} degrees about {axis}"
        apply = believed(lambda p, R=turn: _turned(p, R))
        if np.allclose(_turned(carried, turn).known_part().chi, carried.known_part().chi):
            continue  # it looks the same from there
        yield Fault("frame of the payload", words, joints, loaded, float(np.deg2rad(degrees)), "rad", apply)


def _unmounted(case: SoundCase, joints: tuple[int, ...], loaded: tuple[int, ...]) -> Iterator[Fault]:
    """A payload that was never mounted: its torque taken out of the loaded log."""

    def without(motions: Motions, structure: Structure) -> tuple[Motions, Structure]:
        changed = list(motions)
        for k in loaded:
            log, payload = motions[k].recording, motions[k].payload
            assert payload is not None
            assert case.gain is not None
            model = built(case.arm).model
            states = _states(log)
            extra = _rnea(with_payload(model, payload), *states) - _rnea(model, *states)
            changed[k] = replace(motions[k], recording=Recording(log.t, log.q, log.v - extra / case.gain, log.name))
        return tuple(changed), structure

    yield Fault("payload not mounted", "in the loaded log", joints, loaded, 0.0, "", without)


def _states(log: Recording) -> Samples:
    """Positions, speeds and accelerations of a log below 8 Hz."""
    rate = (len(log.t) - 1) / (log.t[-1] - log.t[0])
    q = signal.sosfiltfilt(signal.butter(2, 8.0, fs=rate, output="sos"), log.q, axis=0)
    dq = np.gradient(q, log.t, axis=0)
    return q, dq, np.gradient(dq, log.t, axis=0)


def _rnea(model: pin.Model, q: Array, dq: Array, ddq: Array) -> Array:
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])


def _exchanged(loaded: tuple[int, ...], count: int) -> list[int]:
    order = list(range(count))
    order[0], order[loaded[0]] = loaded[0], 0
    return order


def _three(x: Array) -> tuple[float, float, float]:
    return float(x[0]), float(x[1]), float(x[2])


def _six(x: Array) -> tuple[float, float, float, float, float, float]:
    a, b, c, d, e, f = x.tolist()
    return a, b, c, d, e, f


def _turned(payload: Payload, R: Array) -> Payload:
    assert payload.com is not None
    assert payload.inertia is not None
    ixx, iyy, izz, ixy, ixz, iyz = payload.inertia
    J = R @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ R.T
    about = np.array([J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]])
    return replace(payload, com=_three(R @ np.array(payload.com)), inertia=_six(about))


def gravity_compensated(case: SoundCase) -> Iterator[Fault]:
    """Gravity torque, with or without the payload, taken from the currents; of the simulator whose masses are known."""
    if case.spec.source != PINOCCHIO or case.gain is None:
        return
    for words, with_load in (("of arm and payload", True), ("of the arm alone", False)):

        def compensated(
            motions: Motions, structure: Structure, with_load: bool = with_load
        ) -> tuple[Motions, Structure]:
            changed: list[Motion] = []
            for each in motions:
                model = built(case.arm).model
                if with_load and each.payload is not None:
                    model = with_payload(model, each.payload)
                log, data = each.recording, model.createData()
                torque = np.array([pin.computeGeneralizedGravity(model, data, q) for q in log.q])
                changed.append(replace(each, recording=Recording(log.t, log.q, log.v - torque / case.gain, log.name)))
            return tuple(changed), structure

        yield Fault("gravity-compensated currents", words, all_joints(case), all_logs(case), None, "", compensated)
