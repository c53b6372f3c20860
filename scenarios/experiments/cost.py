"""Effect of a-priori gains: an additional payload, estimated with a-priori and with identified gains.

The arm is identified from the bare motions. Its torque, with the payload, is predicted on the first loaded motion, from
which the gains were identified.
"""

from ident.estimation.known_gains import estimated_gains, stated_gains
from ident.estimation.problem import ObservedMotion
from ident.identification import Identification
from ident.observation.observation import observe
from ident.payload.payload import Payload
from ident.payload_identification.gains_outcome import gains_outcome, with_unknown_weight
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from scenarios.experiments.build import Setup
from scenarios.experiments.judge import CostTruth, CostVerdict, judge_cost
from scenarios.experiments.nominal_links import nominal_links
from sim.plant import PayloadBody


def cost_verdict(setup: Setup, found: Identification, check: Recording) -> CostVerdict:
    """Estimate payload and arm with the controller's gains and with the identified gains, and judge both.

    Raises:
        IdentificationError: If the motions do not identify the payload.
    """
    table = setup.scenario.table
    assert table.cost is not None, "asked where the scenario has it"
    assert setup.check is not None, "asked where the scenario has it"
    assert found.prepared is not None, "a run has what it was identified from"
    problem, weight = found.prepared.problem, setup.check.plant.payload
    motion = ObservedMotion(observe(check, setup.structure, found.observing), None)
    weighing, options = with_unknown_weight(problem, [motion]), table.identification.method_options
    gains = stated_gains(setup.structure.arm, table.belief.controller_gain), estimated_gains(found.estimate)
    believed, identified = (
        gains_outcome(weighing, _exact(weight), each, options) if len(each.joints) else None for each in gains
    )
    assert believed is not None, "the controller has a gain for every joint"
    truth = CostTruth(weight=weight, base=_true_base(setup), gain=setup.true_gain)
    other = next(each for each in problem.motions if each.payload is not None)
    return judge_cost(believed, identified, truth, other, tolerance=table.cost.mass_error)


def _exact(body: PayloadBody) -> Payload:
    """Return the payload of a body, specified without error."""
    return Payload(mass=body.mass, com=body.com, inertia=body.inertia)


def _true_base(setup: Setup) -> Array:
    """Return the true base parameters of the arm, without friction, shape (b,)."""
    robot, base = setup.plant.robot, setup.structure.base
    links, rotors = nominal_links(robot.model, robot.flange).whole, setup.plant.drives.rotor_inertia
    return base.regrouping @ base.standard(links, {"Ia": rotors})
