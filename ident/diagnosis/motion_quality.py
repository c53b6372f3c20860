"""Quality of the motion of a log: noise, resolution, ranges, reversals, and warming of joints.

Noise is measured from the samples alone: fourth differences remove slow motion and multiply the variance of white noise
by 1 + 16 + 36 + 16 + 1 = 70; steps and spikes hardly change their median magnitude.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, finding, two_digits
from ident.model.arm import Arm
from ident.numerics.neighbours import median, quantum
from ident.numerics.signals import edge_samples, smooth_motion
from ident.observation.full_rate import filtered_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled
from ident.support.arrays import Array, once_per_object, readonly

FOURTH = 70.0
"""Sum of the squares of 1, -4, 6, -4, 1."""
NORMAL_MEDIAN = NormalDist().inv_cdf(0.75)
"""Median magnitude of a standard normal variable."""
NOISY_CURRENT, NOISY_ACCELERATION = 0.3, 0.1
"""Ratio of white noise to standard deviation of a current above which a longer motion hardly helps; ratio of noise to
rms of a filtered acceleration that biases least squares, but not `iv`."""
SLOW_TIME = 0.4
"""Share of the time near reversals above which too little of a motion remains."""
LITTLE = 0.2
"""Range of a joint below which gravity hardly varies [rad or m]."""
GAIN, VISCOUS = 0.001, 0.03
"""Largest relative changes by temperature [1/K] in this project's error budgets: NdFeB magnets, oil."""
MOST_GAIN, MOST_FRICTION = 0.005, 0.1
"""Changes that cause a warning: 0.5 % of a gain, 10 % of friction."""
COLDEST, HOTTEST, JUMP = -40.0, 150.0, 5.0
"""Range of drive temperatures, and largest change between two samples [degrees Celsius]."""
ENDS = 0.05
"""Share of a log at each end whose median is the temperature there."""


class ByJoint(NamedTuple):
    """Positions and currents of a recording, shape (n, N), and their steps from row to row, shape (n, N - 1)."""

    q: Array
    v: Array
    dq: Array
    dv: Array


@lru_cache(maxsize=2)  # a log and its repaired form; cleared after its checks, as it is twice as large as the log
def by_joint(recording: Recording) -> ByJoint:
    """Samples joint by joint, contiguous in time, as several checks need them."""
    q, v = np.ascontiguousarray(recording.q.T), np.ascontiguousarray(recording.v.T)
    return ByJoint(q, v, np.diff(q), np.diff(v))


def noise_std(x: Array) -> Array:
    """Standard deviation of the white noise of signals (n, N) on a uniform clock, shape (n,); zero for under 5 rows."""
    if x.shape[1] < 5:
        return np.zeros(len(x))
    return median(np.abs(np.diff(x, n=4))) / (NORMAL_MEDIAN * np.sqrt(FOURTH))


@once_per_object
def position_noise(recording: Recording) -> Array:
    """`noise_std` of the positions, shape (n,)."""
    return readonly(noise_std(by_joint(recording).q))


@once_per_object
def current_noise(recording: Recording) -> Array:
    """`noise_std` of the currents, shape (n,)."""
    return readonly(noise_std(by_joint(recording).v))


@once_per_object
def position_quanta(recording: Recording) -> tuple[float | None, ...]:
    """Quantisation step of each joint's positions (`quantum`)."""
    return tuple(quantum(q) for q in by_joint(recording).q)


@lru_cache(maxsize=8)  # recordings of one robot are often of one length
def acceleration_of_unit_noise(samples: int, period: float, cutoff_hz: float) -> float:
    """Standard deviation of the filtered accelerations of simulated white noise with unit variance [1/s^2]."""
    edge = edge_samples(period, cutoff_hz)
    white = np.random.default_rng(0).normal(size=(samples, 1))
    return float(np.std(smooth_motion(white, period, cutoff_hz)[2][edge : samples - edge]))


def acceleration_noise(recording: Recording, options: ObserveOptions) -> Array:
    """Ratio of noise to rms of the filtered accelerations, from white noise of the positions, shape (n,)."""
    even = resampled(recording)
    rms = _rms(_filtered(recording, options)[2])
    unit = acceleration_of_unit_noise(len(even.t), even.period, options.cutoff_hz)
    return position_noise(even) * unit / np.where(rms > 0.0, rms, np.inf)


def quiet_cutoff(recording: Recording, options: ObserveOptions) -> float:
    """Cut-off [Hz] at which `NOISY_ACCELERATION` is left: the rms of the noise grows with its power of 2.5."""
    share = min(float(acceleration_noise(recording, options).max()), 0.99)
    of_motion = share / np.sqrt(1.0 - share**2)  # the rms of the acceleration includes the noise
    return options.cutoff_hz * min(1.0, (NOISY_ACCELERATION / of_motion) ** 0.4) if share else options.cutoff_hz


def noise(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check noise and resolution of positions and currents; the worst joint of each is reported."""
    name, steps = recording.name, [(step, j) for j, step in enumerate(position_quanta(recording)) if step is not None]
    coarsest, which = max(steps, default=(None, 0))
    sigma, share = position_noise(recording), acceleration_noise(recording, observing)
    loud = current_noise(recording) / np.std(by_joint(recording).v, axis=1)
    j, k, unit = int(share.argmax()), int(loud.argmax()), "rad or m"
    resolution = finding(name, "encoder resolution", "encoder steps are finer than the noise")
    if coarsest is not None:
        sentence = f"the coarsest encoder has steps of {coarsest:.3g} {unit} (q{which + 1})"
        resolution = finding(name, "encoder resolution", sentence, joints=(which,), value=coarsest, unit=unit)
    return [
        resolution,
        finding(
            name, "noise of q",
            f"q{j + 1} has noise of {sigma[j]:.2g} {unit}, {two_digits(100.0 * share[j])} % of its filtered "
            "acceleration",
            f"use --cutoff-hz {quiet_cutoff(recording, observing):.2g}, or --method iv"
            if share[j] > NOISY_ACCELERATION else None,
            joints=(j,), value=100.0 * share[j], unit="% of the acceleration",
        ),
        finding(
            name, "noise of v", f"v{k + 1} has noise of {two_digits(100.0 * loud[k])} % of its standard deviation",
            "repeat the motion several times" if loud[k] > NOISY_CURRENT else None,
            joints=(k,), value=100.0 * loud[k], unit="% of the standard deviation",
        ),
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotion:
    """Motion of one joint."""

    low: float  # lowest position [rad or m]
    high: float  # highest position [rad or m]
    covered: float | None  # share of the joint's range, None where the model states no limits
    speed: float  # largest speed [rad/s or m/s]
    speed_rms: float  # its root mean square [rad/s or m/s]
    acceleration_rms: float  # root mean square of the acceleration [rad/s^2 or m/s^2]
    slow: float  # share of the time in which samples are masked as near a reversal
    current_rms: float  # root mean square of the current [drive units]


def joint_motions(recording: Recording, arm: Arm, options: ObserveOptions) -> tuple[JointMotion, ...]:
    """Return the motion of the joints of a recording, after the filters."""
    q, dq, ddq, slow = _filtered(recording, options)
    span, columns = arm.upper - arm.lower, {
        "low": q.min(axis=0), "high": q.max(axis=0), "speed": np.abs(dq).max(axis=0), "speed_rms": _rms(dq),
        "acceleration_rms": _rms(ddq), "slow": slow, "current_rms": _rms(recording.v),
    }  # fmt: skip
    return tuple(
        JointMotion(
            covered=float(np.ptp(q[:, j]) / span[j]) if np.isfinite(span[j]) else None,
            **{name: float(each[j]) for name, each in columns.items()},
        )
        for j in range(arm.n)
    )


def motion(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check for joints that move too little or too slowly."""
    q, _, _, beside = _filtered(recording, observing)
    ranges, name = np.ptp(q, axis=0), recording.name
    j, k = int(ranges.argmin()), int(beside.argmax())
    size, slow = f"{ranges[j]:.3g} rad or m", f"near a reversal or at rest for {100.0 * beside[k]:.3g} % of the time"
    extent, advice = f"every joint moves by at least {size} (smallest range: q{j + 1})", None
    reversals, other = f"joints are {slow} or less", None
    if ranges[j] < LITTLE:
        extent, advice = f"q{j + 1} moves by only {size}", "move every joint further"
    if beside[k] > SLOW_TIME:
        reversals, other = f"q{k + 1} is {slow}", "reverse less often, and leave out samples at rest"
    return [
        finding(name, "range", extent, advice, joints=(j,), value=ranges[j], unit="rad or m"),
        finding(name, "reversals", reversals, other, joints=(k,), value=100.0 * beside[k], unit="% of the time"),
    ]


@once_per_object
def _filtered(recording: Recording, options: ObserveOptions) -> tuple[Array, Array, Array, Array]:
    """Positions, speeds, accelerations without edges, (N, n) each, and shares of the time near a reversal, (n,)."""
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    inner = slice(edge, max(edge + 1, len(even.t) - edge))
    q, dq, ddq = (each[inner] for each in filtered_motion(even, options.cutoff_hz))
    return q, dq, ddq, np.mean(np.abs(dq) <= options.reversal_speed * _rms(dq), axis=0)


def _rms(x: Array) -> Array:
    return np.sqrt(np.mean(x**2, axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class Warmth:
    """Temperatures of one log."""

    log: str  # its name
    celsius: Array  # of every joint [degrees Celsius], shape (N, n)


def temperature(warmths: Sequence[Warmth]) -> list[Diagnosis]:
    """Check how much each joint warmed within each log, and from the first log to each other one."""
    found, sound = list[Diagnosis](), list[Warmth]()
    for each in warmths:
        celsius = each.celsius
        inside = (np.isfinite(celsius) & (celsius >= COLDEST) & (celsius <= HOTTEST)).all(axis=0)
        plausible = inside & (np.abs(np.diff(celsius, axis=0)).max(axis=0, initial=0.0) <= JUMP)
        if plausible.all():
            sound.append(each)
            size = max(1, round(ENDS * len(celsius)))
            rise = np.median(celsius[-size:], axis=0) - np.median(celsius[:size], axis=0)
            found.append(_warming(each.log, "warms by", "", rise, 0.5, "warm up longer before recording"))
        else:
            j, limits = int(np.argmin(plausible)), f"{COLDEST:g} to {HOTTEST:g} degrees Celsius"
            sentence = f"the temperature of joint {j + 1} jumps or is outside {limits}; it is ignored"
            found.append(finding(each.log, "temperature", sentence, "check its column and unit", joints=(j,)))
    for each in sound[1:]:
        than = f" than in {PurePath(sound[0].log).name}"
        rise = each.celsius.mean(axis=0) - sound[0].celsius.mean(axis=0)
        advice = "warm up first; record bare, loaded and bare again"
        found.append(_warming(each.log, "is warmer by", than, rise, 1.0, advice))
    return found


def _warming(log: str, verb: str, than: str, rise: Array, mean: float, advice: str) -> Diagnosis:
    """The diagnosis of a rise [K] of each joint, shape (n,), of which a share acts on average."""
    joint = int(np.argmax(np.abs(rise)))
    gain, viscous = (float(np.abs(rise[joint])) * mean * rate for rate in (GAIN, VISCOUS))
    change = f"gain may change by {100 * gain:.2g} %, friction by {100 * viscous:.2g} %"
    weak = gain > MOST_GAIN or viscous > MOST_FRICTION
    return finding(
        log, "temperature", f"joint {joint + 1} {verb} {rise[joint]:.1f} K{than}: {change}", advice if weak else None,
        joints=(joint,), value=rise[joint], unit="K",
    )  # fmt: skip
