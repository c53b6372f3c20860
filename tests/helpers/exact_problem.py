"""A problem with closed-form motions and torques from inverse dynamics: known gains, and errors of 1e-9 by filters."""

from pathlib import Path

import numpy as np

from ident.estimation.problem import GainOptions
from ident.model.regressor import inverse_dynamics
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload
from ident.recordings.recording import Motion, Recording
from scenarios.experiments.robots import robot
from scenarios.results.problem_folder import GivenProblem, write_problem

GAIN = np.array([0.94, -1.3, 25.0, 0.31, 7.1, -0.045])
PAYLOAD = Payload(
    mass=4.3, com=(0.07, -0.05, 0.11), inertia=(0.021, 0.017, 0.012, 0.002, -0.001, 0.003), mass_std=0.005
)


def exact_problem(folder: Path, structure: Structure, *, noise: float = 0.0, motions: int = 2) -> Path:
    """A folder with a bare and a loaded motion; `noise` is white, a share of each joint's rms current.

    Sines are odd about both ends, like the padding of the filter, so the filter has no transient.
    """
    arm, rng = structure.arm, np.random.default_rng(4)
    t, k = np.arange(20_000) / 1000.0, np.arange(1, 9)
    w, chi = 2.0 * np.pi * k / 20.0, rng.uniform(0.5, 2.0, structure.base.regrouping.shape[1])
    found = list[Motion]()
    for payload in (None, PAYLOAD):
        load = chi.copy()
        if payload is not None:
            load[structure.payload_columns] += payload.known_part().chi
        size = 0.6 * rng.uniform(0.5, 1.0, (arm.n, 8)) * rng.choice([-1.0, 1.0], (arm.n, 8)) / k
        angle = t[:, None, None] * w
        q = rng.uniform(-1.0, 1.0, arm.n) + (size * np.sin(angle)).sum(axis=2)
        dq, ddq = (size * w * np.cos(angle)).sum(axis=2), -(size * w**2 * np.sin(angle)).sum(axis=2)
        v = inverse_dynamics(arm, load, q, dq, ddq) / GAIN
        v += noise * np.sqrt(np.mean(v**2, axis=0)) * rng.standard_normal(v.shape)
        found.append(Motion(Recording(t, q, v, "bare" if payload is None else "loaded"), payload))
    observing, limits = ObserveOptions(cutoff_hz=35.0, reversal_speed=0.1), {"noise_floor": 1e-12, "max_rel_std": 10.0}
    gains = GainOptions(**limits)
    write_problem(
        folder, GivenProblem(model=robot().model, arm=arm, motions=found[:motions], observing=observing, gains=gains)
    )
    return folder
