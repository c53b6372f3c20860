"""What a motion puts on every joint: the columns of arm and payload, sampled once, whatever the payload is."""

from dataclasses import dataclass

import numpy as np

from ident.model.regressor import regressor
from ident.model.structure import Structure
from ident.payload.payload import KnownPayload, Payload, standard_parameters
from ident.support.arrays import Array
from sim.plant import PayloadBody
from sim.trajectory import FourierTrajectory

ROWS_PER_SECOND = 20.0
"""Rows that identification keeps, and that deviations are predicted for."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carried:
    """A payload on the flange.

    Attributes:
        chi: Its standard parameters, in the order of `INERTIAL`, shape (10,).
        known: What identification is told of it.
    """

    chi: Array
    known: KnownPayload


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionRows:
    """A motion, sampled: N instants, n joints, p standard columns.

    Attributes:
        motion: q, dq, ddq, each (N, n).
        W: Standard columns of all joints, shape (N, n, p).
        Y: Those of a payload, shape (N, n, 10).
        rigid: Torque of the bare arm and its rotors [N m], shape (N, n).
        bare: The same with friction and offsets.
        rate_hz: Instants a second.
    """

    motion: tuple[Array, Array, Array]
    W: Array
    Y: Array
    rigid: Array
    bare: Array
    rate_hz: float

    def torques(self, chi: Array) -> Array:
        """Joint torques without and with a payload of these standard parameters [N m], shape (2, N, n)."""
        return np.stack((self.bare, self.bare + self.Y @ chi))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmModel:
    """The arm that a motion is designed for.

    Attributes:
        structure: Its identifiable structure.
        chi: Standard parameters of arm and drives, shape (p,).
        inertial: Those of links and rotors alone, the others zero, shape (p,).
        bias: Offset of every joint's torque [N m], shape (n,).
    """

    structure: Structure
    chi: Array
    inertial: Array
    bias: Array

    def rows(self, trajectory: FourierTrajectory, rate_hz: float) -> MotionRows:
        """Sample a motion at a rate."""
        motion = trajectory(np.arange(0.0, trajectory.duration, 1.0 / rate_hz))
        W = regressor(self.structure.arm, *motion)
        return MotionRows(
            motion=motion,
            W=W,
            Y=W[:, :, self.structure.payload_columns],
            rigid=W @ self.inertial,
            bare=W @ self.chi + self.bias,
            rate_hz=rate_hz,
        )


def carried(body: PayloadBody, believed: Payload) -> Carried:
    """What is carried as it is, and as identification is told of it."""
    return Carried(chi=standard_parameters(body.mass, body.com, body.inertia), known=believed.known_part())


def drawn(payload: Payload) -> Carried:
    """A payload that is as drawn."""
    com, inertia = payload.com or (0.0,) * 3, payload.inertia or (0.0,) * 6
    return Carried(chi=standard_parameters(payload.mass, com, inertia), known=payload.known_part())
