"""What tells one picture of a scenario from another: its arm, its motion and what it mounts."""

import hashlib

from scenarios.experiments.files.motions import motion_digest
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.robots import robot_digests
from scenarios.support.result_model import to_json

SEEN = ("robot", "experiment", "plant")
"""Tables of a scenario that a picture of it shows, or that move what it shows."""


def scene_digest(scenario: Scenario) -> str:
    """SHA-256 of all that a picture of a scenario depends on, 16 hexadecimal digits.

    Raises:
        ScenarioError: If it names what is not there.
        RobotError: If the robot's files cannot be read.
    """
    stated, motion = scenario.table.model_dump(mode="json"), scenario.table.experiment.motion
    whole = {
        "tables": {name: stated[name] for name in SEEN},
        "motion": motion_digest(motion, scenario.folder),
        "robot": robot_digests(scenario.table.robot, scenario.folder),
    }
    return hashlib.sha256(to_json(whole).encode()).hexdigest()[:16]
