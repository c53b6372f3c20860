"""The motion of a scenario or of a motion file, with the joints that it moves and what they allow."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.support.toml_files import read_toml
from scenarios.design.motion_formats.limits import MotionLimits
from scenarios.design.motion_formats.sampled import SampledMotion, sampled
from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.motions import KEYS, read_motion
from scenarios.experiments.robot_models import read_arm
from scenarios.support.errors import ScenarioError, UnreadableFile
from sim.torque_limits import check_torque_limits
from sim.trajectory import FourierTrajectory


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Source:
    """A motion and its arm.

    Attributes:
        name: Of the scenario or file.
        motion: The motion.
        arm: What it moves; None where no model is named.
        limits: What that allows.
    """

    name: str
    motion: FourierTrajectory
    arm: Arm | None
    limits: MotionLimits

    def sampled(self, rate_hz: float) -> SampledMotion:
        """The motion at a rate."""
        names, revolute = (
            (None, None) if self.arm is None else (self.arm.joint_names, self.arm.revolute.astype(np.bool_))
        )
        return sampled(self.motion, rate_hz, name=self.name, joint_names=names, revolute=revolute)


def from_source(name: str, model: Path | None, flange: str | None) -> Source:
    """The motion of a scenario, or of a file.

    Args:
        name: Of a built-in scenario, or the path of a scenario's or a motion's file.
        model: Model of the arm, for a motion file; a scenario names its own.
        flange: Last body of that arm.

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
        limits = MotionLimits(lower=lower, upper=upper, velocity=free, acceleration=free)
        return Source(name=name, motion=motion, arm=arm, limits=limits)
    if model is not None or flange is not None:
        raise ScenarioError(f"{name}: a scenario names its own robot; --model and --flange go with a motion file")
    setup = setup_of(load_scenario(name))
    check_torque_limits(setup.experiments)
    return scenario_source(setup)


def scenario_source(setup: Setup) -> Source:
    """The motion of a prepared scenario."""
    arm, plant = setup.structure.arm, setup.experiments[0].plant
    limits = MotionLimits(
        lower=arm.lower, upper=arm.upper, velocity=plant.robot.max_velocity, acceleration=plant.robot.max_acceleration
    )
    motion = setup.experiments[0].trajectory
    return Source(name=setup.scenario.name, motion=motion, arm=arm, limits=limits)
