"""What stands between the plant and its log: encoders in the loop, current sensing beside it."""

from dataclasses import dataclass, fields

import numpy as np
from scipy import signal

from ident.arrays import Array
from sim.errors import PlantError


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorOptions:
    """Noise of the sensors; zero switches a source off.

    Attributes:
        encoder_quantum: Encoder resolution on the joint side [rad].
        encoder_noise: Standard deviation of a reading before quantisation [rad].
        current_white: White noise of the logged current, as a share of the joint's rms current.
        current_coloured: Noise below `coloured_cutoff_hz` of the logged current, as a share of the same.
        coloured_cutoff_hz: Its cut-off [Hz].
    """

    encoder_quantum: float = 0.0
    encoder_noise: float = 0.0
    current_white: float = 0.0
    current_coloured: float = 0.0
    coloured_cutoff_hz: float = 20.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            PlantError: If one is negative.
        """
        for field in fields(self):
            if getattr(self, field.name) < 0.0:
                raise PlantError(f"sensors: {field.name} = {getattr(self, field.name)} is negative")
        if self.current_coloured and not self.coloured_cutoff_hz:
            raise PlantError("sensors: coloured noise needs coloured_cutoff_hz above 0")


def logged_current(v: Array, rate_hz: float, options: SensorOptions, rng: np.random.Generator) -> Array:
    """The current reference as it is logged.

    Args:
        v: Current references [drive units], shape (N, n).
        rate_hz: Their rate [Hz].
        options: Noise levels.
        rng: Source of the noise.

    Returns:
        v with white and coloured noise, both in proportion to each joint's rms current, shape (N, n).
    """
    rms = np.sqrt(np.mean(v**2, axis=0))
    white = options.current_white * rng.standard_normal(v.shape)
    if not options.current_coloured:
        return v + rms * white
    coloured = options.current_coloured * coloured_noise(v.shape, rate_hz, options.coloured_cutoff_hz, rng)
    return v + rms * (white + coloured)


def coloured_noise(shape: tuple[int, int], rate_hz: float, cutoff_hz: float, rng: np.random.Generator) -> Array:
    """Stationary noise of unit variance below a cut-off (second-order Butterworth), shape (N, n).

    Raises:
        PlantError: If the cut-off is not below half the rate.
    """
    if cutoff_hz >= 0.5 * rate_hz:
        raise PlantError(f"sensors: coloured_cutoff_hz = {cutoff_hz:g} needs a log faster than {2.0 * cutoff_hz:g} Hz")
    sos = signal.butter(2, cutoff_hz, fs=rate_hz, output="sos")
    warm_up = int(np.ceil(5.0 * rate_hz / cutoff_hz))
    impulse = signal.sosfilt(sos, np.eye(1, 4 * warm_up)[0])
    white = rng.standard_normal((warm_up + shape[0], shape[1]))
    return signal.sosfilt(sos, white, axis=0)[warm_up:] / np.linalg.norm(impulse)
