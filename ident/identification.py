"""Identify drive gains from an unloaded and a loaded recording: check, observe, estimate, check."""

from dataclasses import dataclass

from ident.agreement import agreed, disagreement_notes, disagreements
from ident.arm import Arm
from ident.contradiction import check_shape, check_signs
from ident.errors import Contradiction
from ident.estimate import GainEstimate
from ident.estimators import estimator
from ident.lag import in_time, lag_notes, lags, with_suspects
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.plausibility import check_load, check_pair, check_positions, residual_notes
from ident.problem import pair
from ident.recording import Recording
from ident.structure import Structure, structure_of
from ident.wiring import WiringCheck, check_wiring

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What `identify` found.

    Attributes:
        estimate: A gain or a reason for each joint, with what proves it, and the payload parameters found on the way.
        notes: What was done to the recordings, and what their owner should know.
    """

    estimate: GainEstimate
    notes: tuple[str, ...]


def identify(
    unloaded: Recording,
    loaded: Recording,
    robot: Arm | Structure,
    payload: Payload,
    *,
    method: str = "ls-2011",
    options: object | None = None,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    wiring: WiringCheck = check_wiring,
) -> Identification:
    """Identify drive gains.

    Args:
        unloaded: Motion with a bare flange.
        loaded: Motion with the payload mounted.
        robot: The arm that moved, or its structure, which takes a while to find for many joints.
        payload: The payload as weighed and drawn.
        method: A name in `ESTIMATORS`.
        options: The method's own, of the class that `ESTIMATORS` names; its defaults if None.
        observing: Filters and thresholds.
        gains: When a gain counts as identifiable, and how its uncertainty is found.
        wiring: What makes sure that the logs are of this arm; `known_wiring` where nobody doubts it.

    Raises:
        IdentificationError: One class a cause, if the data cannot be what they are said to be; the message says what
            they look like.
    """
    chosen = estimator(method)
    structure = robot if isinstance(robot, Structure) else structure_of(robot)
    for recording in (unloaded, loaded):
        check_positions(structure.arm, recording)
    check_pair(unloaded, loaded)
    bare, heavy = observe(unloaded, structure, observing), observe(loaded, structure, observing)
    wiring(structure, unloaded, loaded, observing)
    problem = pair(bare, heavy, payload, gains)
    estimate = chosen.estimate(problem, chosen.options() if options is None else options)
    late = lags(problem, estimate)
    estimate = in_time(estimate, late)
    check_load(estimate)
    try:
        check_signs(estimate)
        check_shape(problem, estimate)
    except Contradiction as error:  # a delay makes one too
        raise Contradiction(with_suspects(str(error), late)) from None
    different = disagreements(problem, estimate)
    notes = bare.notes + heavy.notes + lag_notes(late) + disagreement_notes(different) + residual_notes(estimate)
    return Identification(agreed(estimate, different), notes)
