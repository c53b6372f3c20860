"""The design problem of a scenario: what it believes of its payload, and which joints it wants."""

from dataclasses import replace

import numpy as np

from ident.support.arrays import Indices
from scenarios.design.excitation import Problem
from scenarios.design.limits import robot_limits
from scenarios.design.prediction import prediction_of
from scenarios.design.rows import carried
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import mountings
from scenarios.experiments.files.schema import Scenario
from scenarios.support.errors import ScenarioError


def design_problem(setup: Setup) -> Problem:
    """State the problem with the first payload that the scenario mounts.

    Raises:
        ScenarioError: If it wants no joint's gain; if it mounts no payload.
    """
    scenario = setup.scenario
    wanted = wanted_joints(scenario)
    names = mountings(scenario.table.experiment.protocol)
    if not names:
        raise ScenarioError(
            f'{scenario.name}: experiment.protocol mounts no payload; a design needs one, as ["bare", "loaded"]'
        )
    plant, believed = setup.plants.get(names[0], setup.plant), setup.payloads[names[0]]
    return Problem(
        plant=plant,
        structure=setup.structure,
        limits=robot_limits(plant),
        joints=wanted,
        carried=carried(plant.payload, believed),
        prediction=prediction_of(scenario.table.identification.method),
    )


def wanted_joints(scenario: Scenario) -> Indices:
    """Joints whose gains the scenario wants, from 0.

    Raises:
        ScenarioError: If there are none.
    """
    wanted = np.flatnonzero(scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise ScenarioError(f"{scenario.name}: tolerance.identifiable lists no joint")
    return wanted


def for_all_joints(problem: Problem) -> Problem:
    """The same problem with every joint wanted."""
    return replace(problem, joints=np.arange(len(problem.limits.lower)))
