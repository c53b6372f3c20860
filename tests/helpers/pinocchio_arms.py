"""Pinocchio as the second implementation: random arms, and torques and regressors to compare with."""

import numpy as np
import pinocchio as pin
from plants import CYLINDER

import rx90_mjcf
from sim.plant import PayloadBody

INERTIAL_ORDER = [4, 5, 7, 6, 8, 9, 1, 2, 3, 0]
"""Positions of XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M in Pinocchio's M, MX, MY, MZ, XX, XY, YY, XZ, YZ, ZZ."""
ELBOW = np.eye(6)
ELBOW[2, 1] = 1.0
"""Motor 3 turns the elbow against the base, as with a parallelogram."""
WRIST = np.diag([-1.3, 1.0, 2.0, 1.0, 1.0, 1.0])
WRIST[4:, 4:] = (0.7, 0.4), (0.6, -0.9)
"""A differential wrist of unequal gears, an axis wired in reverse, and a belt."""


def random_arm(rng: np.random.Generator, n: int = 6, prismatic: float = 0.2) -> pin.Model:
    """A serial arm with random axes, placements, inertias and some prismatic joints."""
    model = pin.Model()
    model.name = "random"
    model.gravity = pin.Motion(rng.normal(size=3) * 5.0, np.zeros(3))
    for j in range(n):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        kind = pin.JointModelPrismaticUnaligned if rng.uniform() < prismatic else pin.JointModelRevoluteUnaligned
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        index = model.addJoint(j, kind(axis), pin.SE3(rotation, rng.normal(size=3)), f"joint{j + 1}")
        model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Identity())
    return model


def reference_regressor(model: pin.Model, q, dq, ddq) -> np.ndarray:
    """Inertial columns of the torque regressor in this project's order, shape (N, n, 10 n)."""
    data, n = model.createData(), model.nv
    rows = []
    for state in zip(q, dq, ddq, strict=True):
        W = pin.computeJointTorqueRegressor(model, data, *state)
        rows.append(W.reshape(n, n, 10)[:, :, INERTIAL_ORDER].reshape(n, 10 * n))
    return np.array(rows)


def standard_parameters_of(model: pin.Model) -> np.ndarray:
    """Ten inertial parameters a link in this project's order, shape (n, 10)."""
    return np.array([model.inertias[j + 1].toDynamicParameters()[INERTIAL_ORDER] for j in range(model.nv)])


def pinocchio_arm(*, payload: bool, body: PayloadBody = CYLINDER) -> pin.Model:
    """The arm without rotors, as a second implementation of its rigid-body dynamics."""
    arm = pin.buildModelFromMJCF(str(rx90_mjcf.MJCF))
    arm.armature = np.zeros(6)
    if payload:
        xx, yy, zz, xy, xz, yz = body.inertia
        J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        arm.appendBodyToJoint(6, pin.Inertia(body.mass, np.array(body.com), J), pin.SE3.Identity())
    return arm


def rnea(arm: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    return pin.rnea(arm, arm.createData(), q, dq, ddq)
