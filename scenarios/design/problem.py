"""The design problem of a scenario: what it believes of its payload, and which joints it wants."""

from dataclasses import replace

import numpy as np

from ident.arrays import Indices
from scenarios.build import Bench
from scenarios.design.excitation import Problem
from scenarios.design.limits import robot_limits
from scenarios.design.prediction import prediction_of
from scenarios.design.rows import carried
from scenarios.errors import NoJointWanted, NothingCarried
from scenarios.files.mountings import mountings


def design_problem(prepared: Bench) -> Problem:
    """State the problem with the first payload that the scenario mounts.

    Raises:
        NoJointWanted: If it wants no joint's gain.
        NothingCarried: If it mounts no payload.
    """
    scenario = prepared.scenario
    wanted = wanted_joints(prepared)
    names = mountings(prepared.protocol)
    if not names:
        raise NothingCarried(
            f'{scenario.name}: experiment.protocol mounts no payload; a design needs one, as ["bare", "loaded"]'
        )
    plant = next(each.plant for each in prepared.experiments if each.loaded)
    return Problem(
        plant=plant,
        structure=prepared.structure,
        limits=robot_limits(plant),
        joints=wanted,
        carried=carried(plant.payload, prepared.payloads[names[0]]),
        prediction=prediction_of(scenario.table.identification.method),
    )


def wanted_joints(prepared: Bench) -> Indices:
    """Joints whose gains the scenario wants, from 0.

    Raises:
        NoJointWanted: If there are none.
    """
    wanted = np.flatnonzero(prepared.scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise NoJointWanted(f"{prepared.scenario.name}: tolerance.identifiable wants no joint's gain")
    return wanted


def for_all_joints(problem: Problem) -> Problem:
    """The same problem with every joint wanted."""
    return replace(problem, joints=np.arange(len(problem.limits.lower)))
