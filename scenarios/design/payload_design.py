"""A payload designed for a scenario: what its own shows along the motion, and what the best of each shape would."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.payload.payload import Payload
from ident.support.arrays import Array, Mask
from scenarios.design.excitation import Design, Problem
from scenarios.design.payload_search import Candidate, Carrying, best_weight, payload_torque
from scenarios.design.prediction import RESIDUAL, Deviations
from scenarios.design.problem import design_problem, for_all_joints
from scenarios.design.weights import SHAPES
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import mountings
from scenarios.experiments.files.schema import Scenario
from scenarios.support.errors import ScenarioError
from sim.flange import Flange, flange_of

STEPS = 100 * len(SHAPES)
"""What a design is counted in."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Before:
    """The scenario's own payload along its own motion.

    Attributes:
        payload: As identification is told.
        deviations: Predicted.
        torque: Of the payload on each joint, rms [N m], shape (n,).
        all_torque: Of bare and loaded motion on each joint, rms [N m], shape (n,).
    """

    payload: Payload
    deviations: Deviations
    torque: Array
    all_torque: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PayloadDesign:
    """What a design came to.

    Attributes:
        scenario: For which.
        mounting: Name of the payload that it is in place of.
        problem: Robot, limits, the scenario's own payload, and the joints that are to be shown.
        flange: Where it is mounted.
        most: Largest mass that the robot may carry [kg], None if its file does not say.
        before: The scenario's own payload.
        candidates: The best of each shape, best first, those that must not be mounted last.
        again: The best one along a motion that was searched for it; None if none was.
        shown_below: Largest predicted deviation that counts as shown.
    """

    scenario: Scenario
    mounting: str
    problem: Problem
    flange: Flange
    most: float | None
    before: Before
    candidates: tuple[Candidate, ...]
    again: Candidate | None
    shown_below: float

    @property
    def best(self) -> Candidate:
        """The weight to make.

        Raises:
            ScenarioError: If there is none that may be mounted.
        """
        first = self.candidates[0]
        if first.refusal:
            raise ScenarioError(
                f"{self.scenario.name}: no weight meets the limits: the best {first.weight.shape} {first.refusal}"
            )
        return first

    @property
    def after(self) -> Candidate:
        """The best one, along the motion that it is to be used with."""
        return self.best if self.again is None else self.again

    def shows(self, deviations: Deviations) -> Mask:
        """Which joints' gains identification would not refuse, shape (n,)."""
        return deviations.noise <= self.shown_below

    def worst(self, deviations: Deviations) -> float:
        """Largest deviation of a wanted gain from noise, whatever is known of the payload."""
        return float(deviations.noise[self.problem.joints].max())


def design_payload(
    setup: Setup, *, density: float, seed: int, tell: Callable[[int, Callable[[], str]], None]
) -> PayloadDesign:
    """Search the best weight of every shape along a scenario's motion, to show every joint.

    Args:
        setup: The scenario.
        density: Of the material [kg/m^3].
        seed: Of the search.
        tell: Told how many of `STEPS` are done, and what is being searched.

    Raises:
        ScenarioError: If the scenario mounts no payload.
    """
    problem = for_all_joints(design_problem(setup))
    mounting = mountings(setup.protocol)[0]
    believed, robot, motion = setup.payloads[mounting], problem.plant.robot, setup.experiments[0].trajectory
    design, flange = Design(problem), flange_of(robot)
    rows = design.rows(motion)
    carrying = Carrying(
        design=design,
        motion=motion,
        flange=flange,
        known=believed.known,
        most=np.inf if robot.rated_load is None else robot.rated_load,
        density=density,
    )

    def best(number: int, shape: str) -> Candidate:
        return best_weight(carrying, shape, seed, lambda share: tell(round(100 * (number + share)), lambda: shape))

    candidates = [best(number, shape) for number, shape in enumerate(SHAPES)]
    gains = setup.scenario.table.identification.gains
    return PayloadDesign(
        scenario=setup.scenario,
        mounting=mounting,
        problem=problem,
        flange=flange,
        most=robot.rated_load,
        before=Before(
            payload=believed,
            deviations=design.deviations(rows),
            torque=payload_torque(rows.Y, problem.carried.chi),
            all_torque=np.sqrt(np.mean(rows.torques(problem.carried.chi) ** 2, axis=(0, 1))),
        ),
        candidates=tuple(sorted(candidates, key=lambda each: (bool(each.refusal), each.cost))),
        again=None,
        shown_below=gains.max_rel_std * RESIDUAL / max(gains.noise_floor, RESIDUAL),
    )
