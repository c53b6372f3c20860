"""Gains that are not constant, on arms whose torques are Pinocchio's: what the intervals do not hold is said."""

import numpy as np
import pytest
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, arm_of, fourier, torque, ur_like, with_payload

from ident import identify
from ident.recordings.recording import Motion, Recording
from ident.support.errors import Contradiction

SOURCES = {
    "falls with the size of the current": lambda x, q, log, share: x * (1.0 + 0.05 * np.abs(x)),
    "falls with the size of the current, as its square": lambda x, q, log, share: x * (1.0 + 0.05 * x**2),
    "of log 2 differ from those of the first log": lambda x, q, log, share: x * (1.0 + 0.013 * log),
    "falls within log": lambda x, q, log, share: x * (1.0 + 0.03 * (share - 0.5)),
    "depends on the sign of the current": lambda x, q, log, share: x * (1.0 + 0.03 * np.sign(x)),
    "once a turn": lambda x, q, log, share: x * (1.0 + 0.02 * np.sin(q + 0.7)),
}
"""By what is said of it, current over the largest torque's, by torque over the largest, position, log, and time."""
GRID = np.linspace(0.0, 1.5, 400)


def logs_of(source: str, seed: int):
    """An arm of random masses in some gravity, its logs, and its gains at the rms currents of the loaded log."""
    rng = np.random.default_rng(seed)
    model, current = ur_like(tuple(rng.normal(size=3) * 5.7)), SOURCES[source]
    for inertia in model.inertias:
        inertia.mass *= rng.uniform(0.6, 1.9)
    t = np.arange(0.0, 20.0, 1.0 / 250.0)
    q, dq, ddq = fourier(rng, UR_MIDDLE)(t)
    links = [torque(with_payload(model, each), q, dq, ddq) + 0.3 * np.abs(UR_GAIN) * ddq for each in (None, BRICK)]
    size, speed = np.sqrt(np.mean(links[0] ** 2, axis=0)), np.sqrt(np.mean(dq**2, axis=0))
    motors = [tau + size * (0.1 * dq / speed + 0.2 * np.sign(dq) + 0.02) for tau in links]
    motors = [tau / (1.0 - 0.03 * np.sign(dq * tau)) for tau in motors]
    peak, share, logs, unit = np.max(np.abs(motors), axis=(0, 1)), (t / t[-1])[:, None], [], np.ones(6)
    for k, tau in enumerate(motors):
        x = current(tau / peak, q, k, share)
        if source.startswith("falls with "):
            rms = np.sqrt(np.mean(x**2, axis=0))
            unit = np.interp(rms, current(GRID, 0.0, k, 0.5), GRID) / rms
        v = x * peak / UR_GAIN
        v += 0.01 * np.sqrt(np.mean(v**2, axis=0)) * rng.standard_normal(v.shape)
        logs.append(Motion(Recording(t, q, v, ("bare", "loaded")[k]), BRICK if k else None))
    return arm_of(model), logs, UR_GAIN * unit


@pytest.mark.slow
@pytest.mark.parametrize("source", SOURCES)
def test_a_gain_beyond_its_interval_is_said_or_refused(source):
    said = 0
    for seed in range(3):
        arm, logs, gain = logs_of(source, seed)
        try:
            found = identify(arm, logs)
        except Contradiction as refused:
            said += "all currents are scaled by 1.013 in loaded alone" in str(refused)
            continue
        off = {j + 1: (each.value - gain[j]) / each.std for j, each in found.estimate.identified.items()}
        words = " ".join(found.estimate.remarks)
        assert "seem not to be constant" in words or max(map(abs, off.values())) < 3.0, off
        said += source.split(", as")[0] in words
    assert said >= 2
