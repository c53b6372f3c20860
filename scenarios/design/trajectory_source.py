"""The motion of a scenario or of a motion file, with the joints that it moves and what they allow."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.support.toml_files import read_toml
from scenarios.design.limits import Limits
from scenarios.design.motion_formats import SampledMotion
from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.motions import KEYS, read_motion
from scenarios.experiments.robot_models import read_arm
from scenarios.support.errors import ScenarioError, UnreadableFile
from sim.feedforward_currents import check_torque_limits
from sim.trajectory import FourierTrajectory

MOST = 1_000_000
"""Samples of a file."""
ROUNDING = 1e-9
"""Share of a sample by which a duration may miss a whole number of samples."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """A motion and its arm.

    Attributes:
        name: Of the scenario or file.
        motion: The motion.
        arm: What it moves; None where no model is named.
        limits: What that allows, infinite where nothing is stated; torques are not looked at.
    """

    name: str
    motion: FourierTrajectory
    arm: Arm | None
    limits: Limits

    def sampled(self, rate_hz: float) -> SampledMotion:
        """The motion at a rate; its last sample is its end, which may come sooner than a period after the one before.

        Raises:
            ScenarioError: If that gives fewer than two samples or more than a file should hold; if the model has other
                joints.
        """
        name, arm, duration, n = self.name, self.arm, self.motion.duration, self.motion.n
        if arm is not None and arm.n != n:
            raise ScenarioError(f"{name}: this motion is of {n} joints, but the model has {arm.n}")
        whole = math.ceil(duration * rate_hz * (1.0 - ROUNDING))
        if not 1 <= whole <= MOST:
            raise ScenarioError(f"{name}: {duration:g} s at {rate_hz:g} Hz are {whole:g} samples; expected 1 to {MOST}")
        t = np.minimum(np.arange(whole + 1) / rate_hz, duration)
        t[-1] = duration
        names, revolute = (None, None) if arm is None else (arm.joint_names, arm.revolute.astype(np.bool_))
        q, dq, ddq = self.motion(t)
        return SampledMotion(name=name, joint_names=names, revolute=revolute, t=t, q=q, dq=dq, ddq=ddq)


def from_source(name: str, model: Path | None, flange: str | None) -> Source:
    """The motion of a scenario, or of a file.

    Raises:
        ScenarioError: If a scenario is given a second model; one of its kinds, if the file is neither.
        Saturated: If the scenario's motion asks more of a drive than it has.
    """
    path = Path(name)
    if path.suffix == ".toml" and KEYS[1] in read_toml(path, error=UnreadableFile):
        motion = read_motion(path.name, path.parent)
        arm = None if model is None else read_arm(model, (), flange=flange)
        free = np.full(motion.n, np.inf)
        lower, upper = (-free, free) if arm is None or arm.n != motion.n else (arm.lower, arm.upper)
        limits = Limits(lower=lower, upper=upper, velocity=free, acceleration=free, torque=free)
        return Source(name=name, motion=motion, arm=arm, limits=limits)
    if model is not None or flange is not None:
        raise ScenarioError(f"{name}: a scenario names its own robot; --model and --flange go with a motion file")
    setup = setup_of(load_scenario(name))
    check_torque_limits(setup.experiments)
    return scenario_source(setup)


def scenario_source(setup: Setup) -> Source:
    """The motion of a prepared scenario."""
    arm, robot = setup.structure.arm, setup.plant.robot
    limits = Limits(
        lower=arm.lower,
        upper=arm.upper,
        velocity=robot.max_velocity,
        acceleration=robot.max_acceleration,
        torque=np.full(arm.n, np.inf),
    )
    return Source(name=setup.scenario.name, motion=setup.experiments[0].trajectory, arm=arm, limits=limits)
