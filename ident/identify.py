"""Identify drive gains from an unloaded and a loaded recording: check, observe, estimate, check."""

from collections.abc import Callable

from ident.errors import IdentificationError
from ident.gains import GainEstimate, GainOptions, drive_gains
from ident.observation import Observation, ObserveOptions, observe
from ident.payload import Payload
from ident.plausibility import check_load, check_pair, check_positions, residual_notes
from ident.recording import Recording
from ident.sequential import sequential_gains
from ident.structure import Structure

METHODS: dict[str, Callable[[Observation, Observation, Payload, GainOptions], GainEstimate]] = {
    "ls-2011": drive_gains,
    "sequential-2011": sequential_gains,
}
"""Estimators of one signature: Gautier and Briot's joint by joint (eq. 27), and their sequence (section III.B)."""


def identify(
    unloaded: Recording,
    loaded: Recording,
    structure: Structure,
    payload: Payload,
    *,
    method: str,
    observing: ObserveOptions,
    gains: GainOptions,
) -> tuple[GainEstimate, tuple[str, ...]]:
    """Identify drive gains.

    Args:
        unloaded: Motion with a bare flange.
        loaded: Motion with the payload mounted.
        structure: Of the arm that moved.
        payload: The payload as weighed and drawn.
        method: A name in `METHODS`.
        observing: Filters and thresholds.
        gains: When a gain counts as identifiable.

    Returns:
        A gain or a reason for each joint, and notes on what was done to the recordings.

    Raises:
        IdentificationError: If the data cannot be what they are said to be; the message says what they look like.
    """
    if method not in METHODS:
        raise IdentificationError(f"unknown method {method!r}; known: {', '.join(METHODS)}")
    for recording in (unloaded, loaded):
        check_positions(structure.arm, recording)
    check_pair(unloaded, loaded)
    a, b = observe(unloaded, structure, observing), observe(loaded, structure, observing)
    estimate = METHODS[method](a, b, payload, gains)
    check_load(estimate)
    return estimate, a.notes + b.notes + residual_notes(estimate)
