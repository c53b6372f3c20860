"""Plants and experiments for tests."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import rx90_mjcf
from ident.recordings.recording import Recording
from sim.controller import ControllerBelief, ControllerOptions
from sim.effects import ModelErrors
from sim.errors import SimulationError
from sim.experiment import Experiment
from sim.plant import PayloadBody, Plant
from sim.record import each_record
from sim.robot import read_robot
from sim.sensors import SensorOptions, noise_streams
from sim.sensors.sensor import NoiseStreams
from sim.trajectory import FourierTrajectory, at_rest

CYLINDER = PayloadBody(mass=7.025, com=(0.0, 0.0, 0.142776), inertia=(0.012146, 0.012146, 0.008659, 0.0, 0.0, 0.0))
NOISY = SensorOptions(encoder_quantum=2e-6, encoder_noise=2e-6, current_white=0.05, current_coloured=0.02)


RX90 = read_robot(rx90_mjcf.ROBOT)
BELIEF = ControllerBelief(robot=RX90, gain=(1.0,) * 6)


def nominal_plant(payload: PayloadBody = CYLINDER, errors: ModelErrors | None = None, **drives: np.ndarray) -> Plant:
    return Plant(robot=RX90, drives=replace(RX90.drives, **drives), payload=payload, errors=errors or ModelErrors())


def streams(*seeds: int) -> list[NoiseStreams]:
    return [noise_streams(np.random.default_rng(seed)) for seed in seeds]


def short_motion(duration: float = 2.0, amplitude: float = 0.08) -> FourierTrajectory:
    rng = np.random.default_rng(5)
    sine, cosine = amplitude * rng.normal(size=(2, 6, 3))
    return at_rest(np.array([0.2, 0.3, 1.0, 0.1, 0.4, -0.2]), sine, cosine, duration)


def experiment(**changes) -> Experiment:
    plain = Experiment(
        name="motion",
        plant=nominal_plant(),
        loaded=False,
        trajectory=short_motion(),
        belief=BELIEF,
        controller=ControllerOptions(),
        sensors=NOISY,
        step=1e-3,
    )
    return replace(plain, **changes)


def try_record(experiments: Sequence[Experiment], noise: Sequence[NoiseStreams], threads: int):
    """The recording of each experiment, or why there is none."""
    outcomes: dict[int, Recording | SimulationError] = dict(each_record(experiments, noise, threads=threads))
    return [outcomes[i] for i in range(len(experiments))]
