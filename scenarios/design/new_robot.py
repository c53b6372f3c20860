"""From a model file to a robot and a motion that shows its gains, by rules of thumb where nothing is stated."""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ident.estimation.estimators import DEFAULT
from ident.model.arm import Arm
from ident.model.structure import structure_of
from ident.payload.payload import Payload
from ident.support.arrays import Array
from scenarios.design.excitation import Design, Problem
from scenarios.design.fitting import first_fitted
from scenarios.design.limits import CLEARANCE, robot_limits
from scenarios.design.model_facts import ModelFacts, check_stated_numbers, model_facts
from scenarios.design.rules_of_thumb import Stated, assumed, drives_by_rule, given_home, home_by_rule, load_by_rule
from scenarios.design.search import Found as Point
from scenarios.design.search import Series
from scenarios.experiments.robot_models import check_same_payload, read_arm
from scenarios.prediction.deviations import drawn, prediction_of
from sim.clearance import Clearance
from sim.drives import DriveTruth
from sim.errors import RobotError, TrajectoryError
from sim.plant import PayloadBody, Plant
from sim.robot import Robot
from sim.trajectory import FourierTrajectory

HARMONICS, DURATION = 6, 20.0
"""Of the motion; period [s]."""
ATTEMPTS = 3
"""Searches from other random numbers, if a motion cannot be fitted to its limits."""
CLEAR = 2.0 * CLEARANCE
"""Smallest distance to floor and arm of a home that is clear [m]."""
SHOWN = 0.08
"""Largest predicted relative deviation of a gain that the scenario wants; beyond 0.1 a gain is refused."""

Searching = Callable[[Design, Series, int], Sequence[Point]]
"""Better and better motions that the search with this number finds."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NewRobot:
    """A robot described by its model file and by rules of thumb.

    Attributes:
        name: Of the robot.
        path: Model file.
        model: The same as its robot file names it.
        flange: Last body of the arm, None where all joints are its own.
        arm: The arm.
        facts: What the model file says beyond it.
        drives: By table of a robot file's `[drives]`.
        home: Pose that the search for a motion starts from.
        load: Payload.
        home_clearance: Smallest distance of that pose to floor and arm [m], negative for an overlap.
    """

    name: str
    path: Path
    model: str
    flange: str | None
    arm: Arm
    facts: ModelFacts
    drives: Mapping[str, Stated]
    home: Stated
    load: PayloadBody
    home_clearance: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """A motion and what it shows.

    Attributes:
        motion: Within the robot's limits.
        predicted: Relative standard deviation of each gain, shape (n,).
    """

    motion: FourierTrajectory
    predicted: Array

    @property
    def tolerance(self) -> tuple[float, ...]:
        """Four predicted deviations of each gain, 2 % at least."""
        return tuple(float(f"{max(0.02, 4.0 * min(float(each), 1.0)):.2g}") for each in self.predicted)

    @property
    def identifiable(self) -> tuple[bool, ...]:
        """Joints whose gains the data should give."""
        return tuple(bool(each <= SHOWN) for each in self.predicted)


def described(
    path: Path, folder: Path, *, flange: str | None, name: str | None, home: Sequence[float] | None = None
) -> NewRobot:
    """Read a model file, and state what it leaves open by rules of thumb.

    Args:
        path: MJCF or URDF file.
        folder: Of the robot file that will name it.
        flange: Last body of the arm; joints that do not lead to it are held.
        name: Of the robot; that of the model if None.
        home: Pose to begin from [rad or m]; one by rule if None.

    Raises:
        RobotModelError: If the file is no arm, or is read differently by identification and simulation.
        RobotError: If `home` is no pose of the arm.
        SimulationError: One of its kinds, if links lack an inertia, or joints are too weak for the arm.
    """
    arm = read_arm(path, (), flange=flange)
    check_stated_numbers(path, flange)
    facts = model_facts(path, flange)
    drives = drives_by_rule(arm, path, flange, facts)
    load = load_by_rule(arm, path, flange, drives)
    new = NewRobot(
        name=name or re.sub(r"[^A-Za-z0-9_-]+", "-", arm.name).strip("-") or "robot",
        path=path,
        model=os.path.relpath(path.resolve(), folder.resolve()),
        flange=flange,
        arm=arm,
        facts=facts,
        drives=drives,
        home=assumed(np.zeros(arm.n), "zero"),
        load=load,
        home_clearance=0.0,
    )
    robot = as_robot(new)
    check_same_payload(arm, robot)
    plant = Plant(robot=robot, drives=robot.drives, payload=load)
    clearance = Clearance(plant, margin=3.0 * CLEARANCE)
    pose = home_by_rule(arm, facts, clearance, far=CLEAR) if home is None else given_home(arm, home)
    return replace(new, home=pose, home_clearance=float(clearance(pose.value[None])[0]))


def as_robot(new: NewRobot) -> Robot:
    """The robot that its file will describe."""
    values = {name: stated.value for name, stated in new.drives.items()}
    speed, acceleration = values.pop("max_velocity"), values.pop("max_acceleration")
    return Robot(
        name=new.name,
        model=new.path,
        flange=new.flange,
        drives=DriveTruth(**values),
        max_velocity=speed,
        max_acceleration=acceleration,
        home=new.home.value,
        frames={},
    )


def moved(new: NewRobot, robot: Robot, searched: Searching, *, advice: str) -> Found:
    """Search for a motion that shows all gains.

    Args:
        new: The robot's description.
        robot: The same as its file is read.
        searched: Gives what the search with this number finds.
        advice: What to do if none is found within the limits.

    Raises:
        TrajectoryError: If none is.
        RobotError: If the payload that the arm can bear shows no gain.
    """
    plant, body = Plant(robot=robot, drives=robot.drives, payload=new.load), new.load
    problem = Problem(
        plant=plant,
        structure=structure_of(new.arm),
        limits=robot_limits(plant),
        joints=np.arange(new.arm.n),
        carried=drawn(Payload(mass=body.mass, com=body.com, inertia=body.inertia)),
        prediction=prediction_of(DEFAULT),
    )
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=HARMONICS, duration=DURATION)
    try:
        motion = first_fitted(design, series, (searched(design, series, attempt) for attempt in range(ATTEMPTS)))
    except TrajectoryError as error:
        raise TrajectoryError(
            f"robot {new.name}: {ATTEMPTS} searches for a motion failed: {error}; {advice}"
        ) from error
    found = Found(motion=motion, predicted=design.deviations(design.rows(motion)).total)
    if any(found.identifiable):
        return found
    raise RobotError(
        f"robot {new.name}: the torque limits allow a payload of {body.mass:.2g} kg, which determines no gain "
        f"better than {100.0 * found.predicted.min():.2g} %; correct effort or force ranges, or "
        "masses of the links"
    )
