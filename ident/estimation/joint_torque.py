"""Joint torques of a recording from its currents, tau = g v (paper, eq. 7), with intervals from those of the gains.

This is the torque of the drive, including friction and the amplifier's offset. The interval is that of the gain; it
does not include noise of the currents.
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.known_gains import KnownGains
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices
from ident.support.errors import GainsError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointTorque:
    """Torques of the joints that have a gain.

    Attributes:
        t: Sample times [s], shape (N,).
        joints: The k joints, from 0, shape (k,).
        tau: Torques [N m, or N where a joint slides], shape (N, k).
        std: Their standard deviations from the gains, shape (N, k).
    """

    t: Array
    joints: Indices
    tau: Array
    std: Array


def joint_torque(recording: Recording, gains: KnownGains) -> JointTorque:
    """Return the torques at every sample, of joints that have a gain.

    Raises:
        GainsError: If recording and gains have other numbers of joints, or no joint has a gain.
    """
    if recording.n != len(gains.names):
        raise GainsError(f"{recording.name}: {recording.n} joints, but gains of {len(gains.names)}")
    if not len(gains.joints):
        raise GainsError("gains: no joint has a gain; every one is refused")
    v = recording.v[:, gains.joints]
    return JointTorque(t=recording.t, joints=gains.joints, tau=v * gains.value, std=np.abs(v) * gains.std)
