"""Torques of one case, measured and reconstructed: the rows that figure 3 is drawn from."""

from dataclasses import dataclass

from ident.payload_identification.payload_parameters import PayloadEstimate
from ident.support.arrays import Array, Indices, Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CaseTorques:
    """Rows of a case, of all joints.

    Attributes:
        joint: Joint of each row, from 0, shape (r,).
        loaded: Which rows are of the loaded motion, shape (r,).
        t: Time of each row in its motion [s], shape (r,).
        measured: Gain in use times current [N m], shape (r,).
        reconstructed: What the fitted model makes of the motion [N m], shape (r,).
    """

    joint: Indices
    loaded: Mask
    t: Array
    measured: Array
    reconstructed: Array


def case_torques(case: PayloadEstimate) -> CaseTorques:
    """The rows that a case was identified from."""
    system = case.system
    return CaseTorques(
        joint=system.joint,
        loaded=system.loaded,
        t=system.t,
        measured=case.gain[system.joint] * system.V,
        reconstructed=case.torque,
    )
