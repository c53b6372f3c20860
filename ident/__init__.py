"""Identification of drive gains: recordings in, gains out. Needs NumPy, SciPy and Pinocchio; never a simulator.

    filter     `signals`         zero-phase low-pass of q, central differences
    regress    `regressor`       torque is linear in the standard parameters (eq. 9)
    decimate   `observation`     the same low-pass on currents and columns (eq. 15)
    base       `base`            independent columns (eq. 11), `structure` what each joint sees of them
    solve      `least_squares`   with covariance (eq. 17 to 22)
    gains      `estimators`      from a `problem` to an `estimate`, `ls-2011` joint by joint (eq. 26 and 27)
    judge      `conclusion`      `uncertainty` of the gains, `prediction` of it, `refusal`

`identify` runs them all and checks that the data are what they are said to be. What a user needs is exported here and
read when it is first used. Equation numbers are those of M. Gautier and S. Briot, New Method for Global Identification
of the Joint Drive Gains of Robots using a Known Payload Mass, IROS 2011.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ident.arm import Arm, load_arm
    from ident.errors import IdentificationError
    from ident.estimate import FoundParameter, GainEstimate, IdentifiedGain, RefusedGain
    from ident.estimators import ESTIMATORS
    from ident.identification import Identification, Recorded, identify, identify_motions
    from ident.observation import ObserveOptions
    from ident.options import GainOptions
    from ident.payload import Payload
    from ident.payload_files import read_payload
    from ident.recording import Recording
    from ident.recording_files import read_recording
    from ident.structure import Structure, structure_of
    from ident.uncertainty import UNCERTAINTIES

__all__ = [
    "ESTIMATORS",
    "UNCERTAINTIES",
    "Arm",
    "FoundParameter",
    "GainEstimate",
    "GainOptions",
    "Identification",
    "IdentificationError",
    "IdentifiedGain",
    "ObserveOptions",
    "Payload",
    "Recorded",
    "Recording",
    "RefusedGain",
    "Structure",
    "identify",
    "identify_motions",
    "load_arm",
    "read_payload",
    "read_recording",
    "structure_of",
]

_HOMES = {
    "ESTIMATORS": "estimators",
    "UNCERTAINTIES": "uncertainty",
    "Arm": "arm",
    "FoundParameter": "estimate",
    "GainEstimate": "estimate",
    "GainOptions": "options",
    "Identification": "identification",
    "IdentificationError": "errors",
    "IdentifiedGain": "estimate",
    "ObserveOptions": "observation",
    "Payload": "payload",
    "Recorded": "identification",
    "Recording": "recording",
    "RefusedGain": "estimate",
    "Structure": "structure",
    "identify": "identification",
    "identify_motions": "identification",
    "load_arm": "arm",
    "read_payload": "payload_files",
    "read_recording": "recording_files",
    "structure_of": "structure",
}


def __getattr__(name: str) -> object:
    """Read the module of an exported name when it is first asked for."""
    if name in _HOMES:
        value = getattr(import_module(f"ident.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'ident' has no attribute {name!r}")
