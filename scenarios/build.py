"""From a scenario's tables to the values that `sim` and `ident` work with: truth on one side, belief on the other."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

import rx90_mjcf
from ident.arm import load_arm
from ident.arrays import Array
from ident.errors import PayloadError
from ident.payload import Payload
from ident.payload_files import payload_from_table, read_payload
from ident.structure import Structure, structure_of
from scenarios.errors import ScenarioError
from scenarios.files.motions import read_motion
from scenarios.files.schema import Scenario
from scenarios.files.tables import nearest
from scenarios.robots import robot
from sim.controller import ControllerBelief
from sim.drives import DriveTruth
from sim.plant import PayloadBody, Plant
from sim.record import Experiment


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """Everything a scenario needs to run, for any seed.

    Attributes:
        scenario: Where it came from.
        experiments: The unloaded and the loaded motion.
        structure: Identifiable structure of the arm, from its kinematics.
        payload: The payload as believed.
    """

    scenario: Scenario
    experiments: tuple[Experiment, Experiment]
    structure: Structure
    payload: Payload

    @property
    def true_gain(self) -> Array:
        """The injected drive gains [N m / drive unit], shape (n,)."""
        return self.experiments[0].plant.drives.gain


def bench(scenario: Scenario) -> Bench:
    """Prepare a scenario.

    Raises:
        ScenarioError: If it names a payload or motion that does not exist, or arrays do not fit the arm.
        PayloadError: If the believed payload is impossible.
    """
    table = scenario.table
    structure = _believed_structure()
    if len(table.tolerance.gain) != structure.arm.n:
        raise ScenarioError(f"{scenario.name}: tolerance.gain: the arm has {structure.arm.n} joints")
    plant = true_plant(scenario)
    motion = read_motion(table.experiment.motion, scenario.folder)
    if motion.n != structure.arm.n:
        raise ScenarioError(
            f"{scenario.name}: motion {table.experiment.motion!r} moves {motion.n} joints of {structure.arm.n}"
        )
    belief = ControllerBelief(
        mjcf=plant.robot.model,
        gain=table.belief.controller_gain,
        rotor_inertia=tuple(plant.robot.drives.rotor_inertia.tolist()),
    )
    unloaded, loaded = (
        Experiment(
            name=name,
            plant=plant,
            loaded=name == "loaded",
            trajectory=motion,
            belief=belief,
            controller=table.experiment.controller,
            sensors=table.experiment.sensors,
            step=table.experiment.step,
        )
        for name in ("unloaded", "loaded")
    )
    return Bench(scenario, (unloaded, loaded), structure, believed_payload(scenario))


def true_plant(scenario: Scenario) -> Plant:
    """The truth of a scenario; what it does not state is nominal."""
    stated, arm = scenario.table.plant, robot()
    values = {}
    for field in fields(DriveTruth):
        value = getattr(stated, field.name)
        values[field.name] = np.array(value) if value is not None else getattr(arm.drives, field.name)
    return Plant(robot=arm, drives=DriveTruth(**values), payload=_true_payload(scenario), errors=stated.errors)


def believed_payload(scenario: Scenario) -> Payload:
    """The payload that identification is told."""
    belief = scenario.table.belief
    if isinstance(belief.payload, str):
        payload = _named_payload(belief.payload, scenario)
    else:
        try:
            payload = payload_from_table(belief.payload)
        except PayloadError as error:
            raise ScenarioError(f"{scenario.name}: belief.{error}") from error
    return payload if belief.known is None else replace(payload, known=belief.known)


@lru_cache(maxsize=1)
def _believed_structure() -> Structure:
    """Of the arm as drawn: the same for every trial."""
    return structure_of(load_arm(robot().model))


def _true_payload(scenario: Scenario) -> PayloadBody:
    body = scenario.table.plant.payload
    if isinstance(body, str):
        named = _named_payload(body, scenario)
        assert named.com is not None, "the shipped payloads are complete"
        assert named.inertia is not None, "the shipped payloads are complete"
        return PayloadBody(mass=named.mass, com=named.com, inertia=named.inertia)
    J = body.inertia
    return PayloadBody(mass=body.mass, com=body.com, inertia=(J.ixx, J.iyy, J.izz, J.ixy, J.ixz, J.iyz))


def _named_payload(name: str, scenario: Scenario) -> Payload:
    if name not in rx90_mjcf.PAYLOADS:
        known = ", ".join(rx90_mjcf.PAYLOADS)
        raise ScenarioError(
            f"{scenario.name}: unknown payload {name!r}{nearest(name, rx90_mjcf.PAYLOADS)}; known: {known}"
        )
    return read_payload(rx90_mjcf.PAYLOADS[name])
