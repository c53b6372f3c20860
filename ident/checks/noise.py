"""Noise and resolution of a log's columns, from the samples alone.

Fourth differences are blind to what moves slowly and multiply the variance of white noise by 1 + 16 + 36 + 16 + 1 = 70;
their median size does not mind steps and spikes.
"""

import numpy as np
from scipy import stats

from ident.arrays import Array
from ident.checks.remark import Grade, Remark
from ident.observation import ObserveOptions
from ident.recording import Recording, resampled
from ident.signals import edge_samples, smooth_motion

FOURTH = 70.0
"""Sum of the squares of 1, -4, 6, -4, 1."""
NORMAL_MEDIAN = float(stats.norm.ppf(0.75))
"""Median size of a standard normal variable."""
DIGITS = 1e-9
"""Share of the largest step below which two values are one, written in two ways."""
WHOLE = 0.02
"""Deviation from a whole number of quanta, as a share of one, that rounding of a file makes."""
SHARE = 0.99
"""Share of the samples that are whole numbers of quanta."""
NOISY_CURRENT = 0.3
"""White noise over the deviation of a current that makes deviations larger than a longer motion can pay for."""
NOISY_ACCELERATION = 0.1
"""Noise of a filtered acceleration over its rms that biases least squares; `iv` bears it."""


def noise_std(x: Array) -> Array:
    """Standard deviation of the white noise of columns, shape (n,), zero for fewer than five rows.

    Args:
        x: Samples on a uniform clock, shape (N, n).
    """
    if len(x) < 5:
        return np.zeros(x.shape[1])
    size = np.median(np.abs(np.diff(x, n=4, axis=0)), axis=0)
    return size / (NORMAL_MEDIAN * np.sqrt(FOURTH))


def quantum(x: Array) -> float | None:
    """The step that all values of a column are whole multiples of, shape (N,); None where there is none to be seen."""
    step = np.diff(np.unique(x))
    step = step[step > DIGITS * step.max(initial=0.0)]
    if len(step) < 2:
        return None
    least = float(step.min())
    several = step / np.rint(step / least)  # single steps are rounded by the file; their mean is not
    least = float(np.sum(np.rint(step / least) * several) / np.sum(np.rint(step / least)))
    off = np.abs(step / least - np.rint(step / least))
    return least if float(np.mean(off < WHOLE)) > SHARE and 2 * (len(step) + 1) < len(x) + 2 else None


def acceleration_noise(recording: Recording, options: ObserveOptions) -> Array:
    """Noise of the filtered accelerations over their rms, shape (n,): what white noise of the positions makes of them.

    The filter is fourth order both ways, of which a noise of unit variance leaves `(2 pi f_c)^2 sqrt(0.4 f_c / f_s)`
    or so [1/s^2]; it is measured, on noise itself.
    """
    even = resampled(recording)
    edge = edge_samples(even.period, options.cutoff_hz)
    inner = slice(edge, len(even.t) - edge)
    sigma = noise_std(even.q)
    white = np.random.default_rng(0).normal(size=(len(even.t), 1))
    gain = float(np.std(smooth_motion(white, even.period, options.cutoff_hz)[2][inner]))
    rms = np.sqrt(np.mean(smooth_motion(even.q, even.period, options.cutoff_hz)[2][inner] ** 2, axis=0))
    return sigma * gain / np.where(rms > 0.0, rms, np.inf)


def noise_remarks(recording: Recording, options: ObserveOptions) -> list[Remark]:
    """How noisy and how fine positions and currents are; the worst joint of each."""
    steps = [quantum(q) for q in recording.q.T]
    coarse = [(step, j) for j, step in enumerate(steps) if step is not None]
    sigma, share = noise_std(recording.q), acceleration_noise(recording, options)
    j = int(share.argmax())
    coarsest = f"steps of {max(coarse)[0]:.3g} (q{max(coarse)[1] + 1})" if coarse else "finer than noise"
    loud = noise_std(recording.v) / np.std(recording.v, axis=0)
    k = int(loud.argmax())
    return [
        Remark(topic="encoder resolution", log=recording.name, seen=coarsest),
        Remark(
            topic="noise of q",
            log=recording.name,
            joint=j,
            seen=f"{sigma[j]:.2g} rad or m on q{j + 1}, {100.0 * share[j]:.2g} % of its filtered acceleration",
            grade=Grade.WEAK if share[j] > NOISY_ACCELERATION else Grade.GOOD,
            advice="lower --cutoff-hz, or use --method iv" if share[j] > NOISY_ACCELERATION else None,
        ),
        Remark(
            topic="noise of v",
            log=recording.name,
            joint=k,
            seen=f"{100.0 * loud[k]:.2g} % of the deviation of the current of joint {k + 1}",
            grade=Grade.WEAK if loud[k] > NOISY_CURRENT else Grade.GOOD,
            advice="repeat the motion several times" if loud[k] > NOISY_CURRENT else None,
        ),
    ]
