"""From a scenario's tables to the values that `sim` and `ident` work with: truth on one side, belief on the other."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np

from ident.arm import load_arm
from ident.arrays import Array
from ident.payload import Payload
from ident.structure import Structure, structure_of
from scenarios.errors import WrongLength
from scenarios.files.motions import read_motion
from scenarios.files.mountings import BARE, by_mounting, motion_names, mountings
from scenarios.files.resolved import Resolved, believed_payloads, resolved
from scenarios.files.schema import BodyTable, Scenario
from scenarios.robots import robot
from sim.controller import ControllerBelief
from sim.drives import DriveTruth
from sim.experiment import Experiment
from sim.plant import PayloadBody, Plant


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Everything a scenario needs to run, for any seed.

    Attributes:
        scenario: Where it came from, every number stated.
        experiments: The motions, in order of time.
        structure: Identifiable structure of the arm, from its kinematics.
        payloads: The payloads as believed, by mounting.
    """

    scenario: Resolved
    experiments: tuple[Experiment, ...]
    structure: Structure
    payloads: Mapping[str, Payload]

    @property
    def true_gain(self) -> Array:
        """The injected drive gains [N m / drive unit], shape (n,)."""
        return self.experiments[0].plant.drives.gain

    @property
    def protocol(self) -> tuple[str, ...]:
        """What each motion carries, `bare` or the name of a mounting."""
        return self.scenario.table.experiment.protocol

    @property
    def mounted(self) -> tuple[Payload | None, ...]:
        """The payload of each motion as believed, None for a bare flange; motions of one mounting share one object."""
        return tuple(self.payloads.get(name) for name in self.protocol)


def bench(scenario: Scenario) -> Bench:
    """Prepare a scenario.

    Raises:
        WrongLength: If arrays or the motion do not fit the arm.
        ScenarioError: One of its kinds, if it names a payload or motion that does not exist or is impossible.
    """
    ready = resolved(scenario)
    table = ready.table
    structure = _believed_structure(table.belief.couplings)
    if len(table.tolerance.gain) != structure.arm.n:
        raise WrongLength(f"{scenario.name}: tolerance.gain: the arm has {structure.arm.n} joints")
    protocol = table.experiment.protocol
    plants = true_plants(ready)
    plant = next(iter(plants.values()))
    motion = read_motion(table.experiment.motion, scenario.folder)
    if motion.n != structure.arm.n:
        raise WrongLength(
            f"{scenario.name}: motion {table.experiment.motion!r} moves {motion.n} joints of {structure.arm.n}"
        )
    belief = ControllerBelief(
        mjcf=plant.robot.model,
        gain=table.belief.controller_gain,
        rotor_inertia=tuple(plant.robot.drives.rotor_inertia.tolist()),
    )
    experiments = tuple(
        Experiment(
            name=name,
            plant=plants.get(carried, plant),
            loaded=carried != BARE,
            trajectory=motion,
            belief=belief,
            controller=table.experiment.controller,
            sensors=table.experiment.sensors,
            step=table.experiment.step,
            earlier=earlier,
            warm_up=table.experiment.warm_up,
            pause=table.experiment.pause,
        )
        for earlier, (name, carried) in enumerate(zip(motion_names(protocol), protocol, strict=True))
    )
    believed = believed_payloads(ready)
    return Bench(ready, experiments, structure, {name: believed[name] for name in mountings(protocol)})


def true_plants(scenario: Resolved) -> dict[str, Plant]:
    """The truth of a scenario, by mounting: one robot, with the payload that it carries then."""
    stated, arm = scenario.table.plant, robot()
    drives = DriveTruth(**{field.name: np.array(getattr(stated, field.name)) for field in fields(DriveTruth)})
    return {
        name: Plant(robot=arm, drives=drives, payload=_true_payload(body), errors=stated.errors)
        for name, body in by_mounting(stated.payload, stated.payloads).items()
    }


@lru_cache(maxsize=16)
def _believed_structure(couplings: tuple[tuple[int, int], ...]) -> Structure:
    """Of the arm as drawn, with the couplings that are believed, joints from 1: the same for every trial."""
    return structure_of(load_arm(robot().model, tuple((first - 1, second - 1) for first, second in couplings)))


def _true_payload(body: str | BodyTable) -> PayloadBody:
    assert not isinstance(body, str), "a resolved scenario states its numbers"
    J = body.inertia
    return PayloadBody(mass=body.mass, com=body.com, inertia=(J.ixx, J.iyy, J.izz, J.ixy, J.ixz, J.iyz))
