"""Quality of the motion of a log: noise, resolution, ranges, reversals, and warming of joints.

Noise is measured from the samples alone: fourth differences remove slow motion and multiply the variance of white noise
by 1 + 16 + 36 + 16 + 1 = 70; steps and spikes hardly change their median magnitude.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import PurePath
from statistics import NormalDist

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity, finding
from ident.model.arm import Arm
from ident.numerics.neighbours import quantum
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


def noise_std(x: Array) -> Array:
    """Standard deviation of the white noise of columns (N, n) on a uniform clock, shape (n,); zero for under 5 rows."""
    if len(x) < 5:
        return np.zeros(x.shape[1])
    size = np.median(np.abs(np.diff(np.ascontiguousarray(x.T), n=4)), axis=1)
    return size / (NORMAL_MEDIAN * np.sqrt(FOURTH))


@once_per_object
def position_noise(recording: Recording) -> Array:
    """`noise_std` of the positions, shape (n,)."""
    return readonly(noise_std(recording.q))


@once_per_object
def position_quanta(recording: Recording) -> tuple[float | None, ...]:
    """Quantisation step of each joint's positions (`quantum`)."""
    return tuple(quantum(q) for q in recording.q.T)


@lru_cache(maxsize=8)  # recordings of one robot are often of one length
def acceleration_of_unit_noise(samples: int, period: float, cutoff_hz: float) -> float:
    """Standard deviation of the filtered accelerations of simulated white noise with unit variance [1/s^2].

    With the fourth-order filter, forward and backward, it is about `(2 pi f_c)^2 sqrt(0.4 f_c / f_s)`.
    """
    edge = edge_samples(period, cutoff_hz)
    white = np.random.default_rng(0).normal(size=(samples, 1))
    return float(np.std(smooth_motion(white, period, cutoff_hz)[2][edge : samples - edge]))


def acceleration_noise(recording: Recording, options: ObserveOptions) -> Array:
    """Ratio of noise to rms of the filtered accelerations, from white noise of the positions, shape (n,)."""
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    unit = acceleration_of_unit_noise(len(even.t), even.period, options.cutoff_hz)
    rms = _rms(filtered_motion(even, options.cutoff_hz)[2][edge : len(even.t) - edge])
    return position_noise(even) * unit / np.where(rms > 0.0, rms, np.inf)


def noise(recording: Recording, observing: ObserveOptions) -> list[Diagnosis]:
    """Check noise and resolution of positions and currents; the worst joint of each is reported."""
    steps = [(step, j) for j, step in enumerate(position_quanta(recording)) if step is not None]
    coarsest, which = max(steps, default=(None, 0))
    sigma, share = position_noise(recording), acceleration_noise(recording, observing)
    loud = noise_std(recording.v) / np.std(recording.v, axis=0)
    j, k = int(share.argmax()), int(loud.argmax())
    return [
        finding(recording.name, "encoder resolution", "encoder steps are finer than the noise")
        if coarsest is None
        else finding(
            recording.name, "encoder resolution",
            f"the coarsest encoder has steps of {coarsest:.3g} rad or m (q{which + 1})",
            joints=(which,), value=coarsest, unit="rad or m",
        ),
        finding(
            recording.name, "noise of q",
            f"q{j + 1} has noise of {sigma[j]:.2g} rad or m, {100.0 * share[j]:.2g} % of its filtered acceleration",
            "lower --cutoff-hz, or use --method iv" if share[j] > NOISY_ACCELERATION else None,
            joints=(j,), value=100.0 * share[j], unit="% of the acceleration",
        ),
        finding(
            recording.name, "noise of v", f"v{k + 1} has noise of {100.0 * loud[k]:.2g} % of its standard deviation",
            "repeat the motion several times" if loud[k] > NOISY_CURRENT else None,
            joints=(k,), value=100.0 * loud[k], unit="% of the standard deviation",
        ),
    ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotion:
    """Motion of one joint.

    Attributes:
        low: Lowest position [rad or m].
        high: Highest position [rad or m].
        covered: Share of the joint's range, None where the model states no limits.
        speed: Largest speed [rad/s or m/s].
        speed_rms: Its root mean square [rad/s or m/s].
        acceleration_rms: Root mean square of the acceleration [rad/s^2 or m/s^2].
        slow: Share of the time in which samples are masked as near a reversal.
        current_rms: Root mean square of the current [drive units].
    """

    low: float
    high: float
    covered: float | None
    speed: float
    speed_rms: float
    acceleration_rms: float
    slow: float
    current_rms: float


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
    ranges = np.ptp(q, axis=0)
    j, k = int(ranges.argmin()), int(beside.argmax())
    little, still = f"{ranges[j]:.3g} rad or m", f"near a reversal or at rest for {100.0 * beside[k]:.3g} % of the time"
    short, slow = ranges[j] < LITTLE, beside[k] > SLOW_TIME
    return [
        finding(
            recording.name, "range",
            f"q{j + 1} moves by only {little}" if short
            else f"every joint moves by at least {little} (smallest range: q{j + 1})",
            "move every joint further" if short else None,
            joints=(j,), value=ranges[j], unit="rad or m",
        ),
        finding(
            recording.name, "reversals", f"q{k + 1} is {still}" if slow else f"joints are {still} or less",
            "reverse less often, and leave out samples at rest" if slow else None,
            joints=(k,), value=100.0 * beside[k], unit="% of the time",
        ),
    ]  # fmt: skip


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
    """Temperatures of one log.

    Attributes:
        log: Its name.
        celsius: Of every joint [degrees Celsius], shape (N, n).
    """

    log: str
    celsius: Array


def temperature(warmths: Sequence[Warmth]) -> list[Diagnosis]:
    """Check how much each joint warmed within each log, and from the first log to each other one.

    Magnets and friction change with temperature. The default estimator has separate friction for every motion, which
    accounts for differences between motions, but not for drift within one.

    Args:
        warmths: Temperatures of the logs that have them, in the order of the command line; may be empty.
    """
    found, sound = list[Diagnosis](), list[Warmth]()

    def warming(log: str, verb: str, than: str, rise: Array, mean: float, advice: str) -> None:
        """Add the diagnosis of a rise, of which the share `mean` affects the motion on average."""
        joint = int(np.argmax(np.abs(rise)))
        gain, viscous = (float(np.abs(rise[joint])) * mean * rate for rate in (GAIN, VISCOUS))
        sentence = (
            f"joint {joint + 1} {verb} {rise[joint]:.1f} K{than}: gain may change by {100 * gain:.2g} %, friction by "
            f"{100 * viscous:.2g} %"
        )
        weak = gain > MOST_GAIN or viscous > MOST_FRICTION
        given = advice if weak else None
        found.append(finding(log, "temperature", sentence, given, joints=(joint,), value=rise[joint], unit="K"))

    for each in warmths:
        celsius = each.celsius
        inside = (np.isfinite(celsius) & (celsius >= COLDEST) & (celsius <= HOTTEST)).all(axis=0)
        plausible = inside & (np.abs(np.diff(celsius, axis=0)).max(axis=0, initial=0.0) <= JUMP)
        if plausible.all():
            sound.append(each)
            size = max(1, round(ENDS * len(celsius)))
            rise = np.median(celsius[-size:], axis=0) - np.median(celsius[:size], axis=0)
            warming(each.log, "warms by", "", rise, 0.5, "warm up longer before recording")
        else:
            j = int(np.argmin(plausible))
            sentence = (
                f"the temperature of joint {j + 1} jumps or is outside {COLDEST:g} to {HOTTEST:g} degrees Celsius; it "
                "is ignored"
            )
            found.append(finding(each.log, "temperature", sentence, severity=Severity.WEAK, joints=(j,)))
    for each in sound[1:]:
        than, rise = PurePath(sound[0].log).name, each.celsius.mean(axis=0) - sound[0].celsius.mean(axis=0)
        advice = "warm up first; record bare, loaded and bare again"
        warming(each.log, "is warmer by", f" than in {than}", rise, 1.0, advice)
    return found
