"""A design problem of an invented arm of three joints, which has no shapes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from plants import CYLINDER
from robot_folders import robot_folder

from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.payload.payload import Payload
from scenarios.design.excitation import Design, Limits
from scenarios.prediction.deviations import Carried, all_joints
from sim.plant import Plant
from sim.robot import read_robot


def invented_design(folder: Path) -> Design:
    """The problem of an arm that is written into a folder."""
    robot = read_robot(robot_folder(folder, 3))
    plant = Plant(robot=robot, drives=robot.drives, payload=replace(CYLINDER, com=(0.05, -0.03, 0.14)))
    body = plant.payload
    believed = Payload(mass=body.mass, com=body.com, inertia=body.inertia)
    return Design(
        plant=plant,
        structure=structure_of(load_arm(robot.model)),
        limits=Limits.of(plant),
        joints=np.arange(3),
        carried=Carried.of(body, believed),
        prediction=all_joints,
    )
