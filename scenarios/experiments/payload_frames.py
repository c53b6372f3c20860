"""Check that identification and simulation mount a payload at the same place of a robot.

It is separate from the check of kinematics, which commands without a simulation also need.
"""

import numpy as np

from ident.model.arm import Arm
from ident.model.parameters import INERTIAL, STANDARD
from ident.model.regressor import regressor
from ident.payload.payload import standard_parameters
from ident.support.errors import RobotModelError
from ident.support.naming import one_line
from scenarios.experiments.robot_models import STATES, TOLERANCE
from sim.compile import bare_arm
from sim.controller import inverse_dynamics
from sim.plant import PayloadBody
from sim.robot import Robot

ROUNDING = 1e-12
"""Rounding error of subtracted torques, as a share of their size; for an arm of a ton it exceeds a payload's
millionth."""
PROBE = PayloadBody(mass=2.3, com=(0.11, -0.07, 0.16), inertia=(0.031, 0.027, 0.019, 0.004, -0.003, 0.002))
"""A payload without any symmetry."""


def check_same_payload(arm: Arm, robot: Robot) -> None:
    """Compare the torques of a payload at random states, by the identification model and by MuJoCo.

    Its frame, that of the last link, must be the same for both.

    Raises:
        RobotModelError: If they differ.
    """
    q, dq, ddq = np.random.default_rng(0).uniform(-2.0, 2.0, (3, STATES, arm.n))
    models = (bare_arm(robot.model, robot.drives.rotor_inertia, robot.flange, body) for body in (PROBE, None))
    loaded, bare = (inverse_dynamics(model, q, dq, ddq) for model in models)
    W = regressor(arm, q, dq, ddq)[..., len(STANDARD) * (arm.n - 1) :][..., : len(INERTIAL)]
    torque = W @ standard_parameters(PROBE.mass, PROBE.com, PROBE.inertia)
    if np.abs(loaded - bare - torque).max() > TOLERANCE * np.abs(torque).max() + ROUNDING * np.abs(loaded).max():
        raise RobotModelError(
            f"robot model {one_line(robot.model)}: Pinocchio and MuJoCo put a payload on the last link at "
            "different places; save it with MuJoCo (mj_saveLastXML) and use that file"
        )
