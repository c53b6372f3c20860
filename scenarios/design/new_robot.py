"""From a model file to a robot and an exciting motion, with rules of thumb for values that are not stated."""

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.estimation.estimators import DEFAULT
from ident.model.arm import Arm
from ident.model.structure import structure_of
from ident.support.arrays import Array
from scenarios.design.arm_end import ArmEnd, arm_end
from scenarios.design.excitation import Design, Problem
from scenarios.design.first_load import Load, first_load
from scenarios.design.fitting import about_a_pose, first_fitted, quickened
from scenarios.design.limits import robot_limits
from scenarios.design.model_facts import ModelFacts, check_stated_numbers, model_facts
from scenarios.design.rules_of_thumb import Stated, assumed, drives_by_rule, given_home, home_by_rule
from scenarios.design.search import Found as Point
from scenarios.design.search import Series
from scenarios.experiments.payload_frames import check_same_payload
from scenarios.experiments.robot_models import read_arm
from scenarios.prediction.deviations import drawn, prediction_of
from sim.clearance import CLEARANCE, Clearance
from sim.errors import NoPositionError, RobotError, TrajectoryError
from sim.plant import Plant
from sim.robot import DriveTruth, Robot
from sim.trajectory import FourierTrajectory

HARMONICS, DURATION = 6, 20.0
"""Harmonics of the motion, and period [s]."""
ATTEMPTS = 3
"""Number of searches with other seeds if a motion cannot be scaled to its limits."""
CLEAR = 2.0 * CLEARANCE
"""Smallest distance of a clear home pose to floor and arm [m]."""
SHOWN = 0.04
"""Largest predicted relative standard deviation of a gain that the scenario requires.

Above 0.1 a gain is refused, and for a weak arm friction increases the standard deviation to up to 2.5 times the
predicted one.
"""

Searching = Callable[[Design, Series, int], Sequence[Point]]
"""Yields successively better motions of the search with this seed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewRobot:
    """A robot from its model file and rules of thumb.

    Attributes:
        name: Name of the robot.
        path: Model file.
        model: Path of the model file in the robot file.
        end: Last body of the arm, and joints recognised as those of a gripper.
        arm: The arm.
        facts: Other data of the model file.
        drives: Values by table of a robot file's `[drives]`.
        home: Start pose of the search for a motion.
        load: Payload, with its origin.
        home_clearance: Smallest distance of the home pose to floor and arm [m], negative for an overlap.
        always_near: Pairs of links, or of link and payload, that are too near to each other at all positions.
    """

    name: str
    path: Path
    model: str
    end: ArmEnd
    arm: Arm
    facts: ModelFacts
    drives: Mapping[str, Stated]
    home: Stated
    load: Load
    home_clearance: float
    always_near: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """A motion and the predicted accuracy.

    Attributes:
        motion: Motion within the robot's limits.
        predicted: Relative standard deviation of each gain, shape (n,).
    """

    motion: FourierTrajectory
    predicted: Array

    @property
    def tolerance(self) -> tuple[float, ...]:
        """Tolerances: four predicted standard deviations of each gain, at least 2 %."""
        return tuple(float(f"{max(0.02, 4.0 * min(float(each), 1.0)):.2g}") for each in self.predicted)

    @property
    def identifiable(self) -> tuple[bool, ...]:
        """Joints whose gains should be identifiable."""
        return tuple(bool(each <= SHOWN) for each in self.predicted)


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """Values stated in addition to the model file; None for rules of thumb.

    Attributes:
        flange: Last body of the arm; joints outside the chain to it are locked.
        name: Name of the robot; default: that of the model.
        home: Start pose [rad or m].
        torque: Largest torques of the joints [N m or N].
        rated_load: Rated load [kg].
        payload: Payload file, or the mass of a bar [kg].
    """

    flange: str | None = None
    name: str | None = None
    home: Sequence[float] | None = None
    torque: Sequence[float] | None = None
    rated_load: float | None = None
    payload: Path | float | None = None


def described(path: Path, folder: Path, given: Given) -> NewRobot:
    """Read a model file, and add values by rules of thumb.

    Raises:
        RobotModelError: If the file is not an arm, or identification and simulation read it differently.
        RobotError: If the home pose is not valid, the number of torques is wrong, or joints are too weak.
        PayloadError: If the payload file is not valid.
        SimulationError: One of its kinds, if links lack an inertia.
    """
    end = ArmEnd(given.flange) if given.flange is not None else arm_end(path)
    flange = end.flange
    arm = read_arm(path, (), flange=flange)
    check_stated_numbers(path, flange)
    facts = model_facts(path, flange)
    drives = drives_by_rule(arm, path, flange, facts, given.torque)
    load = first_load(arm, path, flange, drives, rated=given.rated_load, payload=given.payload)
    new = NewRobot(
        name=given.name or re.sub(r"[^A-Za-z0-9_-]+", "-", arm.name).strip("-") or "robot",
        path=path,
        model=os.path.relpath(path.resolve(), folder.resolve()),
        end=end,
        arm=arm,
        facts=facts,
        drives=drives,
        home=assumed(np.zeros(arm.n), "zero"),
        load=load,
        home_clearance=0.0,
        always_near=(),
    )
    robot = as_robot(new)
    check_same_payload(arm, robot)
    plant = Plant(robot=robot, drives=robot.drives, payload=load.body)
    clearance = Clearance(plant, margin=3.0 * CLEARANCE)
    pose = home_by_rule(arm, facts, clearance, far=CLEAR) if given.home is None else given_home(arm, given.home)
    distance = float(clearance(pose.value[None])[0])
    return replace(new, home=pose, home_clearance=distance, always_near=clearance.always_near)


def as_robot(new: NewRobot) -> Robot:
    """Return the robot of the future robot file."""
    values = {name: stated.value for name, stated in new.drives.items()}
    speed, acceleration = values.pop("max_velocity"), values.pop("max_acceleration")
    return Robot(
        name=new.name,
        model=new.path,
        flange=new.end.flange,
        drives=DriveTruth(**values),
        max_velocity=speed,
        max_acceleration=acceleration,
        home=new.home.value,
        frames={},
    )


def moved(new: NewRobot, robot: Robot, searched: Searching, *, advice: str) -> Found:
    """Search for a motion that identifies all gains.

    Raises:
        TrajectoryError: If none is found.
        RobotError: If the payload that the arm can carry identifies no gain.
    """
    body = new.load.body
    plant = Plant(robot=robot, drives=robot.drives, payload=body)
    problem = Problem(
        plant=plant,
        structure=structure_of(new.arm),
        limits=robot_limits(plant),
        joints=np.arange(new.arm.n),
        carried=drawn(new.load.payload),
        prediction=prediction_of(DEFAULT),
    )
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=HARMONICS, duration=DURATION)
    motion = quickened(design, _motion(design, series, searched, f"robot {new.name}", advice))
    found = Found(motion=motion, predicted=design.deviations(design.rows(motion)).total)
    if any(found.identifiable):
        return found
    raise RobotError(
        f"robot {new.name}: the torque limits allow a payload of {body.mass:.2g} kg, which determines no gain "
        f"better than {two_digits(100.0 * found.predicted.min())} %; correct effort or force ranges, or masses of "
        "the links, or state what the arm may carry with --rated-load"
    )


def _motion(design: Design, series: Series, searched: Searching, name: str, advice: str) -> FourierTrajectory:
    """Return the best motion of some searches, scaled to the limits if necessary."""
    bests: list[FourierTrajectory] = []

    def searches() -> Iterator[Sequence[Point]]:
        for attempt in range(ATTEMPTS):
            kept = searched(design, series, attempt)
            bests.append(series.motion(kept[-1].x))
            yield kept

    try:
        return first_fitted(design, series, searches())
    except NoPositionError as error:
        raise TrajectoryError(f"{error}: --payload KG; or name a pose that can be held and is clear, --home") from error
    except TrajectoryError as error:
        smaller = [small for best in bests for small in about_a_pose(design, best)]
        if smaller:
            return min(smaller, key=design.cost)
        raise TrajectoryError(f"{name}: {ATTEMPTS} searches for a motion failed: {error}; {advice}") from error
