"""Conversion of a scenario's tables to inputs of `sim` and `ident`, with true and assumed values separate."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache

from ident.model.structure import Structure
from ident.payload.payload import Payload
from ident.support.arrays import Array, readonly
from scenarios.experiments.motions import read_motion
from scenarios.experiments.robots import structure as believed_structure
from scenarios.experiments.scenario import Value, believed_payloads, robot_of, with_settings
from scenarios.experiments.scenario_files import MOTION
from scenarios.experiments.schema import BARE, BodyTable, Scenario, by_mounting, motion_names, mountings
from scenarios.support.errors import ScenarioError, UnknownName
from sim.controller import ControllerBelief
from sim.experiment import Experiment
from sim.plant import PayloadBody, Plant
from sim.robot import DriveTruth

CHECK = "check-weight"
"""Name of the motion that is not used for identification; no mounting can have a name with a hyphen."""
DRIVES_KEPT = 16
"""Number of cached drives; one takes a kilobyte."""


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """All inputs for running a scenario, for any seed.

    Attributes:
        scenario: The scenario.
        plants: The true plants, by mounting.
        structure: Identifiable structure of the arm, from its kinematics.
        payloads: The assumed payloads, by mounting.
        experiments: The motions, in order of time; empty if the robot has no motion yet.
        check: One more motion, which is not used for identification; None without a table `cost`.
    """

    scenario: Scenario
    plants: Mapping[str, Plant]
    structure: Structure
    payloads: Mapping[str, Payload]
    experiments: tuple[Experiment, ...] = ()
    check: Experiment | None = None

    @property
    def plant(self) -> Plant:
        """The true plant with the first mounting."""
        return next(iter(self.plants.values()))

    @property
    def true_gain(self) -> Array:
        """The injected drive gains [N m / drive unit], shape (n,)."""
        return self.plant.drives.gain

    @property
    def protocol(self) -> tuple[str, ...]:
        """The mounting of each motion, `bare` or a name."""
        return self.scenario.table.experiment.protocol

    @property
    def mounted(self) -> tuple[Payload | None, ...]:
        """The assumed payload of each motion, None for a bare flange; motions of one mounting share one object."""
        return tuple(self.payloads.get(name) for name in self.protocol)

    @property
    def true_payloads(self) -> dict[str, PayloadBody]:
        """The true payloads, by mounting."""
        pairs = zip(self.protocol, self.experiments, strict=True)
        return {carried: experiment.plant.payload for carried, experiment in pairs if experiment.loaded}


def setup_without_motion(scenario: Scenario) -> Setup:
    """Prepare a scenario's robot without motions.

    Raises:
        ScenarioError: If arrays do not fit the arm; one of its kinds, if the scenario names a robot or payload that
            does not exist or is impossible.
        SimulationError: One of its kinds, if robot or plant are impossible.
        RobotModelError: If the robot's model file is not an arm.
    """
    table, arm = scenario.table, robot_of(scenario)
    if len(table.tolerance.gain) != arm.n:
        raise ScenarioError(
            f"{scenario.name}: tolerance.gain has {len(table.tolerance.gain)} values, but robot {arm.name} has {arm.n} "
            "joints; state arrays of plant, belief and tolerance for this robot, one value per joint"
        )
    structure = believed_structure(arm, tuple((first - 1, second - 1) for first, second in table.belief.couplings))
    believed = believed_payloads(scenario)
    payloads = {name: believed[name] for name in mountings(table.experiment.protocol)}
    drives = _drives(**{field.name: getattr(table.plant, field.name) for field in fields(DriveTruth)})
    plants = {
        name: Plant(robot=arm, drives=drives, payload=_true_payload(body), errors=table.plant.errors)
        for name, body in by_mounting(table.plant.payload, table.plant.payloads).items()
    }
    return Setup(scenario, plants, structure, payloads)


def setup_of(scenario: Scenario) -> Setup:
    """Prepare a scenario.

    Raises:
        ScenarioError: If arrays or the motion do not fit the arm; one of its kinds, if it names a payload or motion
            that does not exist or is impossible.
    """
    setup = setup_without_motion(scenario)
    table, plant = scenario.table, setup.plant
    protocol, n = table.experiment.protocol, plant.robot.n
    try:
        motion = read_motion(table.experiment.motion, scenario.folder)
    except UnknownName as error:
        raise UnknownName(f"{scenario.asking.get(MOTION, scenario.name)}: {MOTION}: {error}") from error
    if motion.n != n:
        raise ScenarioError(f"{scenario.name}: motion {table.experiment.motion!r} moves {motion.n} joints of {n}")
    belief = ControllerBelief(
        mjcf=plant.robot.model,
        gain=table.belief.controller_gain,
        rotor_inertia=tuple(plant.robot.drives.rotor_inertia.tolist()),
        flange=plant.robot.flange,
    )
    experiments = tuple(
        Experiment(
            name=name,
            plant=setup.plants.get(carried, plant),
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
    check = None
    if table.cost is not None:
        weighed = replace(plant, payload=_true_payload(table.cost.payload))
        check = replace(experiments[-1], name=CHECK, plant=weighed, loaded=True, earlier=len(experiments))
    return replace(setup, experiments=experiments, check=check)


def changed(setup: Setup, settings: Mapping[str, Value]) -> Setup:
    """Return the setup with changed values of its scenario; itself if there are none.

    Raises:
        ScenarioError: If a key path does not exist.
        WrongValue: If a value is not valid.
        ScenarioError: As `setup_of`.
    """
    return setup_of(with_settings(setup.scenario, settings)) if settings else setup


@lru_cache(maxsize=DRIVES_KEPT)
def _drives(**stated: tuple[float, ...]) -> DriveTruth:
    """Return the drives of given numbers, cached, so that scenarios that differ in something else share them."""
    return DriveTruth(**{name: readonly(values) for name, values in stated.items()})


def _true_payload(body: str | BodyTable) -> PayloadBody:
    assert not isinstance(body, str), "a resolved scenario states its numbers"
    J = body.inertia
    return PayloadBody(mass=body.mass, com=body.com, inertia=(J.ixx, J.iyy, J.izz, J.ixy, J.ixz, J.iyz))


def body_of(payload: Payload) -> PayloadBody:
    """Return a complete payload as a rigid body."""
    assert payload.com is not None, "its centre is stated"
    assert payload.inertia is not None, "its moments are stated"
    return PayloadBody(mass=payload.mass, com=payload.com, inertia=payload.inertia)
