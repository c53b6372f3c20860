"""The motion of a scenario or of a motion file, with its arm and limits."""

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
"""Largest number of samples of a file."""
ROUNDING = 1e-9
"""Tolerance of the duration, in sampling periods."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """A motion and its arm.

    Attributes:
        name: Name of the scenario or file.
        motion: The motion.
        arm: The arm; None without a model.
        limits: Limits of the arm, infinite if not stated; torques are not checked.
    """

    name: str
    motion: FourierTrajectory
    arm: Arm | None
    limits: Limits

    def sampled(self, rate_hz: float) -> SampledMotion:
        """Return the motion sampled at a rate; the last sample is its end, so the last period may be shorter.

        Raises:
            ScenarioError: If there are fewer than two samples or too many; if the number of joints differs.
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
        ScenarioError: If a model is given for a scenario; one of its subclasses, if the file is neither.
        Saturated: If a drive cannot follow the scenario's motion.
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
    """Return the motion of a prepared scenario."""
    arm, robot = setup.structure.arm, setup.plant.robot
    limits = Limits(
        lower=arm.lower,
        upper=arm.upper,
        velocity=robot.max_velocity,
        acceleration=robot.max_acceleration,
        torque=np.full(arm.n, np.inf),
    )
    return Source(name=setup.scenario.name, motion=setup.experiments[0].trajectory, arm=arm, limits=limits)
