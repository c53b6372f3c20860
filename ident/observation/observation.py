"""The linear system of one motion, joint by joint: filtered, masked at velocity reversals and decimated.

Near a reversal sign(dq) is wrong: the filtered velocity crosses zero too early or too late, and real friction sticks.
Those samples of a joint are masked before decimation, in its current and in every column, so that every row is still a
linear combination of exact equations (paper, eq. 15; `docs/derivations.md`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from annotated_types import Interval, Unit

from ident.model.displacement import Kinematics
from ident.model.parameters import STANDARD
from ident.model.regressor import BLOCK, LinkMotions, regressor_blocks
from ident.model.structure import Structure
from ident.numerics.neighbours import quantum, widened
from ident.numerics.signals import (
    FILTER_ORDER,
    KERNEL_CUTOFFS,
    SETTLING,
    SHARE_OF_RATE,
    Decimator,
    decimator,
    delayed,
    edge_samples,
    group_means,
    noise_density,
)
from ident.observation.full_rate import FullRate, filtered_motion
from ident.recordings.checks import intervals_of
from ident.recordings.recording import JITTER_TOL, Recording, resampled
from ident.support.arrays import Array, Indices, Mask, Pieces, readonly
from ident.support.errors import OptionError, RecordingError
from ident.support.options import MEASURED, refuse_outside

PIECE = 128
"""Number of samples that D is applied to at once: D is banded, and longer pieces multiply mostly zeros."""
MOST_BENT = 0.05
"""Largest share of a joint's rms speed that a lowered filter may remove; friction at reversals causes up to 2 %."""
LONGEST_DELAY = 1.0
"""Longest delay between the stamp of a current and its action [s]; real ones are a few periods of the controller."""
REGRESSOR_RATE = 32.0
"""Lowest rate at which the regressor is evaluated, in multiples of the position cut-off.

Faster recordings are first averaged in groups. The regressor of a mean differs from the mean of regressors: components
at the cut-off have a relative error of (pi / 32)^2 / 6 = 2e-3, at a tenth of it of 2e-5.
"""


BLUR = 0.5
"""Time around a reversal that is masked, in periods of the position cut-off.

Coulomb friction that changes sign makes a step of the acceleration; the low-pass of the positions blurs it by half a
period to each side, but not the step of the current."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObserveOptions:
    """Conversion of a recording to a linear system. The defaults suit motions with harmonics below 1 Hz.

    Attributes:
        cutoff_hz: Low-pass of the positions before differentiation [Hz].
        decimation_cutoff_hz: Low-pass of currents and regressor columns [Hz].
        rows_per_second: Rows kept per second [1/s].
        reversal_speed: Speed below which a joint's samples are masked, as a share of its rms speed. Unless it is 0,
            samples within half a period of `cutoff_hz` around a reversal are also masked.
        current_delay: Time from the stamp of a current to the middle of its action [s]: half a control period for a
            reference that is held, negative for currents that are logged late, 0 for a measured current or if half a
            period is negligible.
        min_weight: Smallest share of a row's filter weight on unmasked samples; other rows are omitted.
    """

    cutoff_hz: Annotated[float, Interval(ge=1e-3, le=1e5), Unit("Hz")] = 15.0
    decimation_cutoff_hz: Annotated[float, Interval(ge=1e-3, le=1e5), Unit("Hz")] = 10.0
    rows_per_second: Annotated[float, Interval(ge=1e-3, le=1e5), Unit("Hz")] = 20.0
    reversal_speed: Annotated[float, Interval(ge=0.0, le=10.0)] = 0.1
    current_delay: Annotated[float, Interval(ge=-LONGEST_DELAY, le=LONGEST_DELAY), Unit("s")] = field(
        default=0.0, metadata={MEASURED: "a delay common to all logs and joints"}
    )
    min_weight: Annotated[float, Interval(ge=-1.0, le=1.0)] = 0.5

    def __post_init__(self) -> None:
        """Check the values; raises `OptionError`."""
        refuse_outside(self, OptionError)
        if self.rows_per_second > 3.0 * self.decimation_cutoff_hz:
            raise OptionError(
                f"rows_per_second = {self.rows_per_second:g}: rows closer than a third of the period of "
                f"decimation_cutoff_hz = {self.decimation_cutoff_hz:g} are redundant; request fewer"
            )


DEFAULTS = ObserveOptions()


@dataclass(frozen=True, slots=True, eq=False)
class JointObservation:
    """Rows of one joint and one motion: `V g = W @ chi + W_L @ chi_L` up to errors."""

    V: Array  # currents [drive units], shape (r,)
    W: Array  # base columns of the arm that act on the joint, shape (r, b)
    columns: Indices  # their indices in the structure's base columns, shape (b,)
    W_L: Array  # the payload's ten columns, shape (r, 10)
    weight: Array  # remaining filter weight of each row, below 1 near reversals, shape (r,)
    t: Array  # time at the middle of each row's filter [s], shape (r,)
    position: Indices  # number of each row, including omitted rows, shape (r,)
    row_period: float  # time from one row to the next [s]


@dataclass(frozen=True, eq=False)
class Observation:
    """The linear system of one motion."""

    structure: Structure
    joints: tuple[JointObservation, ...]  # one `JointObservation` per joint
    notes: tuple[str, ...]  # changes of the recording that the user should know
    full_rate: FullRate | None = None  # the motion of the rows at full rate, None without a recording

    @property
    def recorded(self) -> FullRate:
        """The motion of the rows, which must exist."""
        assert self.full_rate is not None, "asked of recordings only"
        return self.full_rate

    @cached_property
    def kinematics(self) -> Pieces[Kinematics]:
        """Kinematics along the motion, at the samples where torques are evaluated."""
        arm, states = self.structure.arm, self.recorded.states
        return Pieces(len(states.q), lambda piece: Kinematics.of(arm, states.of(piece)))

    @cached_property
    def link_motions(self) -> Pieces[LinkMotions]:
        """Motion of the links, for torques of given parameters."""
        arm, states = self.structure.arm, self.recorded.states
        return Pieces(len(states.q), lambda piece: LinkMotions.of(arm, *states.of(piece)))


def observe(
    recording: Recording, structure: Structure, options: ObserveOptions, spoilt: Mask | None = None
) -> Observation:
    """Convert a recording of n joints to the linear system of its motion, joint by joint (paper, eq. 14 and 15).

    A jittered clock is resampled and noted; `spoilt` is a mask of samples that each joint's rows must not use, (N, n).
    Raises `RecordingError` if the number of joints differs from the arm's, or the recording is too short or too slowly
    sampled for the filters.
    """
    n = structure.arm.n
    if recording.n != n:
        raise RecordingError(f"{recording.n} joints, but robot {structure.arm.name} has {n}", recording.name)
    notes = []
    if recording.jitter > JITTER_TOL:
        found = intervals_of(recording.t)
        missing = f", and {found.lost} samples are missing" if found.lost else ""
        notes.append(
            f"{recording.name}: sampling intervals vary by {100.0 * found.jitter:.3g} %{missing}; resampled at "
            f"{1.0 / recording.period:.4g} Hz"
        )
        recording = resampled(recording)
    duration, nyquist = float(recording.t[-1] - recording.t[0]), 0.5 / recording.period
    highest = max(options.cutoff_hz, options.decimation_cutoff_hz)
    if highest >= nyquist:
        raise RecordingError(
            f"sampled at {2.0 * nyquist:.4g} Hz, too slow for a cut-off of {highest:g} Hz; choose one below "
            f"{nyquist:.4g} Hz",
            recording.name,
        )
    if 2.0 * SETTLING / options.cutoff_hz + KERNEL_CUTOFFS / options.decimation_cutoff_hz > duration:
        raise RecordingError(
            f"the recording of {duration:.3g} s is too short for cut-offs of {options.cutoff_hz:g} and "
            f"{options.decimation_cutoff_hz:g} Hz",
            recording.name,
        )
    edge = edge_samples(recording.period, options.cutoff_hz)
    inner = slice(edge, max(edge, len(recording.t) - edge))
    group = max(1, int(1.0 / (recording.period * REGRESSOR_RATE * options.cutoff_hz)))
    period = group * recording.period
    D = decimator(period, options.decimation_cutoff_hz, max(1, round(1.0 / (period * options.rows_per_second))))
    v = delayed(recording.v, options.current_delay / recording.period)
    t, v = (group_means(x[inner], group) for x in (recording.t, v))
    rows = D.rows(len(t))
    if rows < 10 * n:
        raise RecordingError(f"{duration:.3g} s give {rows} rows; at least {10 * n} are needed", recording.name)
    q, dq, ddq = (group_means(x[inner], group) for x in filtered_motion(recording, options.cutoff_hz))
    middle = t[: rows * D.factor : D.factor] + 0.5 * (len(D.kernel) - 1) * period
    reach = round(BLUR / (options.cutoff_hz * period)) if options.reversal_speed else 0
    moving = _moving(structure, dq, options.reversal_speed, reach)
    if spoilt is not None and spoilt.any():
        moving &= group_means(widened(spoilt, edge)[inner].astype(np.float64), group) == 0.0
    V, W = reduced(structure, (q, dq, ddq), v, moving, D)
    joints: list[JointObservation] = []
    for j, Wj in enumerate(W):
        own, columns = len(STANDARD) * structure.first_links[j], structure.joint_columns[j]
        weight = Wj[:, len(STANDARD) * j - own + STANDARD.index("off")]  # ones, now the remaining weight
        keep = weight >= options.min_weight
        joints.append(
            JointObservation(
                V=readonly(V[keep, j]),
                W=readonly(Wj[np.ix_(keep, structure.base.columns[columns] - own)]),
                columns=columns,
                W_L=readonly(Wj[np.ix_(keep, structure.payload_columns - own)]),
                weight=readonly(weight[keep]),
                t=readonly(middle[keep]),
                position=np.flatnonzero(keep),
                row_period=period * D.factor,
            )
        )
    behind = FullRate(
        q=q,
        dq=dq,
        ddq=ddq,
        moving=moving,
        period=period,
        cutoff_hz=options.cutoff_hz,
        decimator=D,
        edge=edge,
        group=group,
        noise=noise_density(recording.q, recording.period),
        recording=recording,
        current_delay=options.current_delay,
    )
    return Observation(structure, tuple(joints), tuple(notes), behind)


def reduced(
    structure: Structure, motion: tuple[Array, Array, Array], v: Array, moving: Mask, D: Decimator
) -> tuple[Array, list[Array]]:
    """Decimate the unmasked samples, block by block, so that the full-rate regressor is never stored.

    The motion is q, dq, ddq; these, a signal v of each joint, and the mask `moving` of each joint's used samples have
    the shape (N, n). Returned are the signals, (rows, n), and the regressor of each joint from the columns of the first
    link that it moves on.
    """
    n, rows, first = structure.arm.n, D.rows(len(v)), [len(STANDARD) * link for link in structure.first_links]
    piece = D.factor * max(1, PIECE // D.factor)
    band = D.band(piece)
    weight = moving.astype(np.float64)
    weighted = weight * v
    reached = D.overlap + -(-len(v) // piece) * piece // D.factor  # rows, with those that reach beyond the data
    V = np.zeros((reached, n))
    W = [np.zeros((reached, structure.base.regrouping.shape[1] - own)) for own in first]
    size = piece * max(1, BLOCK // piece)
    for block, columns in regressor_blocks(structure.arm, *motion, weight=weight, size=size):
        for start in range(block.start, block.stop, piece):
            inside = slice(start - block.start, min(start + piece, block.stop) - block.start)
            weights = band[:, : inside.stop - inside.start]
            touched = slice(start // D.factor, start // D.factor + len(band))
            V[touched] += weights @ weighted[start : start + piece]
            for j in range(n):
                W[j][touched] += weights @ columns[j, first[j] :, inside].T
    whole = slice(D.overlap, D.overlap + rows)
    return V[whole], [Wj[whole] for Wj in W]


def _moving(structure: Structure, dq: Array, share: float, reach: int) -> Mask:
    """Mask of samples where each joint, and each coupled sum that acts on it, is away from reversals, (N, n)."""

    def away(speed: Array) -> Mask:
        turning = np.diff(speed > 0.0, axis=0, prepend=speed[:1] > 0.0)
        return (np.abs(speed) > share * np.sqrt(np.mean(speed**2, axis=0))) & ~widened(turning, reach)

    moving = away(dq)
    for first, second in structure.arm.couplings:
        moving[:, [first, second]] &= away(dq[:, [first]] + dq[:, [second]])
    return moving


def following(options: ObserveOptions, recordings: Sequence[Recording]) -> tuple[ObserveOptions, str | None]:
    """Return the filters for recordings that are used together, and a note if the slowest requires lower ones.

    Default cut-offs that are too high for a log's rate are lowered; specified ones are not. Raises `RecordingError` if
    a joint moves too fast for the lowered filter, as inertias would be estimated too small.
    """
    slowest = max(recordings, key=lambda each: each.period)
    rate = 1.0 / slowest.period
    highest = SHARE_OF_RATE * rate
    lowered = options
    for name in ("cutoff_hz", "decimation_cutoff_hz"):
        if getattr(options, name) == getattr(DEFAULTS, name) > highest:
            lowered = replace(lowered, rows_per_second=min(lowered.rows_per_second, 2.0 * highest), **{name: highest})
    if lowered is options:
        return options, None
    for each in recordings:
        bent = _bent(each, lowered.cutoff_hz)
        j = int(np.argmax(bent))
        if bent[j] > MOST_BENT:
            raise RecordingError(
                f"joint {j + 1} moves too fast for a log at {1.0 / each.period:.4g} Hz: a low-pass at "
                f"{lowered.cutoff_hz:.3g} Hz removes {100.0 * bent[j]:.2g} % of its speed; log faster or move slower",
                each.name,
                joint=j,
                value=float(bent[j]),
                bounds=(0.0, MOST_BENT),
            )
    return lowered, (
        f"{slowest.name}: logged at {rate:.4g} Hz, so positions are low-passed at {lowered.cutoff_hz:.3g} Hz and "
        f"currents at {lowered.decimation_cutoff_hz:.3g} Hz"
    )


def _bent(recording: Recording, cutoff_hz: float) -> Array:
    """Return the share of each joint's rms speed that a low-pass removes, shape (n,)."""
    q, period = recording.q, recording.period
    window = np.hanning(len(q))[:, None]
    f = np.fft.rfftfreq(len(q), period)
    power = np.abs(np.fft.rfft(window * (q - q.mean(axis=0)), axis=0)) ** 2
    steps = np.array([quantum(column) or 0.0 for column in q.T])  # quantisation, not motion
    density = np.maximum(noise_density(q, period), 2.0 * period * steps**2 / 12.0)
    noise = density * np.sum(window**2) / (2.0 * period)
    square = (2.0 * np.pi * f[:, None]) ** 2
    speeds = square * np.where(power > 10.0 * noise, power, 0.0)
    taken = 1.0 - 1.0 / (1.0 + (f[:, None] / cutoff_hz) ** (2 * FILTER_ORDER))  # forward and backward
    whole, lost = speeds.sum(axis=0), (taken**2 * speeds).sum(axis=0)
    lost = np.where(lost > 2.0 * (taken**2 * square * noise).sum(axis=0), lost, 0.0)  # not motion
    return np.sqrt(lost / np.where(whole > 0.0, whole, 1.0))
