"""Faults of time: late and filtered currents, clocks, lost and repeated samples, drift between logs."""

from collections.abc import Iterator

import numpy as np
from diagnosis_cases import SoundCase
from diagnosis_fault import Change, Fault, Samples, all_joints, all_logs, in_logs, joint_of, last_log, number, places
from scipy import interpolate, signal

from ident.support.arrays import Array


def _late(late: float, *joints: int) -> Change:
    """Currents, all or some joints', later than their positions by any part of a sample; the log stays even."""

    def changed(t: Array, q: Array, v: Array) -> Samples:
        columns = list(joints or range(v.shape[1]))
        v[:, columns] = interpolate.make_interp_spline(t, v[:, columns], k=1)(np.clip(t - late, t[0], t[-1]))
        inside = (t - late >= t[0]) & (t - late <= t[-1])
        return t[inside], q[inside], v[inside]

    return changed


def delays(case: SoundCase) -> Iterator[Fault]:
    for where, logs in places(case):
        for late in (0.002, 0.005, 0.015, -0.004) if where != "in log 1" else (0.008,):
            words = f"{1e3 * late:+g} ms {where}"
            yield Fault("delay", words, all_joints(case), logs, late, "s", in_logs(_late(late), logs))
    for k, late in enumerate((0.003, 0.006, 0.015)):
        j = joint_of(case, k)
        words = f"v{number(j)} by {1e3 * late:+g} ms in all logs"
        yield Fault(
            "delay of one joint", words, (j,), all_logs(case), late, "s", in_logs(_late(late, j), all_logs(case))
        )
    n = case.structure.arm.n
    if n > 2 and len(case.motions) > 1:  # drives of the wrist on a bus of their own
        wrist = tuple(range((n + 1) // 2, n))
        for late in (0.003, 0.007):
            apply = in_logs(_late(late, *wrist), last_log(case))
            words = f"v{number(wrist[0])} to v{n} by {1e3 * late:+g} ms in log 2"
            yield Fault("delay of the wrist", words, wrist, last_log(case), late, "s", apply)


def filters(case: SoundCase) -> Iterator[Fault]:
    def low_passed(hz: float) -> Change:
        def changed(t: Array, q: Array, v: Array) -> Samples:
            rate = (len(t) - 1) / (t[-1] - t[0])
            kept = float(np.exp(-2.0 * np.pi * hz / rate))
            return t, q, signal.lfilter([1.0 - kept], [1.0, -kept], v, axis=0, zi=kept * v[:1])[0]

        return changed

    rate = min((len(each.recording.t) - 1) / (each.recording.t[-1] - each.recording.t[0]) for each in case.motions)
    for hz in (80.0, 40.0, 15.0):
        if hz < 0.45 * rate:
            words = f"low-pass of first order at {hz:g} Hz in all logs"
            apply = in_logs(low_passed(hz), all_logs(case))
            yield Fault("filter of the currents", words, all_joints(case), all_logs(case), hz, "Hz", apply)


def clocks(case: SoundCase) -> Iterator[Fault]:
    for where, logs in places(case)[:2]:
        for factor in (1.02, 1.1, 2.0):
            apply = in_logs(lambda t, q, v, factor=factor: (factor * t, q, v), logs)
            end = "" if where == "in all logs" else " of one log"
            yield Fault(f"clock{end}", f"time times {factor:g} {where}", all_joints(case), logs, factor, "", apply)
    apply = in_logs(lambda t, q, v: (1e3 * t, q, v), all_logs(case))
    yield Fault("clock", "time in milliseconds", all_joints(case), all_logs(case), 1000.0, "", apply)


def samples(case: SoundCase) -> Iterator[Fault]:
    every, joints = all_logs(case), all_joints(case)

    def lost(share: float, honest: bool) -> Change:
        def changed(t: Array, q: Array, v: Array) -> Samples:
            kept = np.random.default_rng(71).random(len(t)) >= share
            kept[[0, -1]] = True
            return (t[kept] if honest else t[: kept.sum()]), q[kept], v[kept]

        return changed

    def repeated(share: float) -> Change:
        def changed(t: Array, q: Array, v: Array) -> Samples:
            again = np.random.default_rng(72).random(len(t)) < share
            again[0] = False
            rows = np.maximum.accumulate(np.where(again, 0, np.arange(len(t))))
            return t, q[rows], v[rows]

        return changed

    def gap(seconds: float, honest: bool) -> Change:
        def changed(t: Array, q: Array, v: Array) -> Samples:
            begin = t[0] + 0.43 * (t[-1] - t[0])
            kept = (t < begin) | (t >= begin + seconds)
            return (t[kept] if honest else t[: kept.sum()]), q[kept], v[kept]

        return changed

    for share in (0.005, 0.01, 0.02):
        words = f"{100 * share:g} % in all logs"
        yield Fault("lost samples", words, joints, every, share, "", in_logs(lost(share, True), every), harmless=True)
        yield Fault("lost samples, time even", words, joints, every, share, "", in_logs(lost(share, False), every))
        yield Fault("repeated samples", words, joints, every, share, "", in_logs(repeated(share), every))
    for seconds, honest in ((0.5, True), (0.5, False), (0.1, False)):
        words = f"{seconds:g} s {'missing' if honest else 'cut out, time even'} in the last log"
        yield Fault("gap", words, joints, (every[-1],), seconds, "s", in_logs(gap(seconds, honest), (every[-1],)))


def drifts(case: SoundCase) -> Iterator[Fault]:
    last = last_log(case)
    if len(case.motions) < 2:
        return
    if case.gain is not None:
        for share in (0.3, 1.0, -0.3):

            def rubbed(t: Array, q: Array, v: Array, share: float = share) -> Samples:
                smooth = signal.sosfiltfilt(
                    signal.butter(2, 12.0, fs=(len(t) - 1) / (t[-1] - t[0]), output="sos"), q, axis=0
                )
                dq = np.gradient(smooth, t, axis=0)
                size = 0.25 * np.sqrt(np.mean(v**2, axis=0)) * np.sign(case.gain if case.gain is not None else 1.0)
                rms = np.sqrt(np.mean(dq**2, axis=0))
                return t, q, v + share * size * (np.tanh(dq / (0.02 * rms)) + 0.5 * dq / rms)

            words = f"{100 * share:+g} % of what is usual in log 2"
            yield Fault(
                "friction of one log", words, all_joints(case), last, share, "", in_logs(rubbed, last), harmless=True
            )
    for share in (0.01, 0.03, -0.03):
        words = f"all v times {1 + share:g} in log 2"
        apply = in_logs(lambda t, q, v, share=share: (t, q, (1.0 + share) * v), last)
        yield Fault("gain by temperature", words, all_joints(case), last, 1.0 + share, "", apply)
    n = case.structure.arm.n
    ramp = in_logs(lambda t, q, v: (t, q, v * (1.0 + 0.04 * (t[:, None] - t[0]) / (t[-1] - t[0]))), last)
    yield Fault("gain by temperature", "all v up by 4 % along log 2", tuple(range(n)), last, 1.04, "", ramp)
