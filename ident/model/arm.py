"""The kinematics of a fixed-base serial arm, read from MJCF or URDF through Pinocchio.

Identification needs only the joint axes, no nominal inertias, so an `Arm` has only these.
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ident.model.files import minimal_model
from ident.model.files.mjcf import NAME_IT
from ident.support.arrays import Array, readonly
from ident.support.errors import RobotModelError
from ident.support.files import captured_stderr
from ident.support.naming import one_line

if TYPE_CHECKING:
    import pinocchio as pin  # pyright: ignore[reportMissingImports]  (its wheel installs beside site-packages)

MOST_JOINTS = 24
"""Largest number of joints of an arm; the computing time grows with its fourth power and is seconds here."""
FARTHEST = 50.0
"""Largest plausible distance between neighbouring joints along an axis [m]."""
STRONGEST_GRAVITY = 100.0
"""Largest plausible gravity [m/s^2]."""
NOT_TURNED = 1e-6
"""Largest difference of a rotation times its transpose from 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """A fixed-base serial arm with n one-axis joints.

    Frame j is fixed to link j and has its origin on joint j; the frames are those of the model file.

    Attributes:
        name: Model name.
        joint_names: n names, base to flange.
        rotation: Orientation of frame j in frame j - 1 at zero position, shape (n, 3, 3).
        translation: Origin of frame j in frame j - 1 at zero position [m], shape (n, 3).
        axis: Unit joint axis in frame j, shape (n, 3).
        revolute: True for a revolute joint, False for a prismatic one, shape (n,).
        gravity: Gravity in the base frame [m/s^2], shape (3,).
        lower: Lower position limits [rad or m], -inf where the model states none, shape (n,).
        upper: Upper position limits [rad or m], inf where the model states none, shape (n,).
        couplings: Pairs of joints (from 0) whose second motor turns with the sum of both speeds, as axes 5 and 6 of
            Staubli's wrists do.
    """

    name: str
    joint_names: tuple[str, ...]
    rotation: Array
    translation: Array
    axis: Array
    revolute: Array
    gravity: Array
    lower: Array
    upper: Array
    couplings: tuple[tuple[int, int], ...] = ()

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)


def load_arm(path: str | Path, couplings: tuple[tuple[int, int], ...] = (), *, flange: str | None = None) -> Arm:
    """Read an arm from an MJCF (`.xml`, `.mjcf`) or URDF (`.urdf`) file.

    Args:
        path: The model file. Meshes are not read.
        couplings: Pairs of coupled joints, from 0, which model files do not state.
        flange: Last body of the arm; joints outside the chain to it are locked at their initial positions. None if all
            joints belong to the arm.

    Returns:
        The arm's kinematics.

    Raises:
        RobotModelError: If the file is missing, unreadable, or not a fixed-base serial arm of revolute
            and prismatic joints, or a coupling names a joint that does not exist.
    """
    model = load_pinocchio(path, flange=flange)
    try:
        arm = replace(arm_from_pinocchio(model), couplings=couplings)
        _check_plausible(arm)
    except RobotModelError as error:
        raise RobotModelError(f"robot model {one_line(path)}: {error}") from error
    return arm


def _check_plausible(arm: Arm) -> None:
    far = np.flatnonzero(~(np.abs(arm.translation) <= FARTHEST).all(axis=1))
    if len(far):
        place = " ".join(f"{x:g}" for x in arm.translation[far[0]])
        raise RobotModelError(
            f"joint {arm.joint_names[far[0]]} is at {place} m from the one before, beyond {FARTHEST:g}; check the "
            "numbers and their unit"
        )
    weight = float(np.linalg.norm(arm.gravity))
    if not weight:
        raise RobotModelError("gravity is 0 or disabled; without weight no gain can be identified")
    if weight > STRONGEST_GRAVITY:
        raise RobotModelError(f"gravity is {weight:g} m/s^2, beyond {STRONGEST_GRAVITY:g}; check the number")
    if len(set(arm.couplings)) < len(arm.couplings):
        raise RobotModelError("a coupling is given twice")
    for first, second in arm.couplings:
        if not 0 <= first < second < arm.n:
            raise RobotModelError(
                f"cannot couple joints {first + 1} and {second + 1}; expected two of its {arm.n} joints, the one "
                "nearer to the base first"
            )


def load_pinocchio(path: str | Path, *, flange: str | None = None) -> "pin.Model":
    """Read the Pinocchio model of an MJCF or URDF file: its kinematics and gravity, not its masses.

    Raises:
        RobotModelError: If the file is missing, of an unknown kind or unreadable.
    """
    minimal = minimal_model(Path(path), flange)
    import pinocchio as pin  # a fifth of a second that a command's help does without  # pyright: ignore[reportMissingImports]

    with captured_stderr() as printed:  # urdfdom prints its errors instead of raising them
        try:
            if minimal.kind == "urdf":
                model = pin.buildModelFromXML(minimal.text)
            else:
                with tempfile.TemporaryDirectory() as folder:  # this reader accepts only files
                    file = Path(folder) / "arm.xml"
                    file.write_text(minimal.text, encoding="utf-8")
                    model = pin.buildModelFromMJCF(str(file))
        except (ValueError, RuntimeError, IndexError) as error:
            reason = error
        else:
            model.gravity.linear = np.array(minimal.gravity)
            for name, (lower, upper) in minimal.ranges.items():
                index = model.joints[model.getJointId(name)].idx_q
                model.lowerPositionLimit[index], model.upperPositionLimit[index] = lower, upper
            return model
    first = (printed or str(reason).strip().splitlines() or ["unknown reason"])[0]
    said = one_line(first.removeprefix("Error:").split(".  ")[0])
    raise RobotModelError(f"robot model {one_line(path)}: Pinocchio cannot read it: {said}") from reason


def arm_from_pinocchio(model: "pin.Model") -> Arm:
    """Take the kinematics of a Pinocchio model.

    Raises:
        RobotModelError: If the model is not a fixed-base serial arm of revolute and prismatic joints.
    """
    n = model.njoints - 1
    if n < 1:
        raise RobotModelError(f"robot {model.name}: it has no moving joint")
    if n > MOST_JOINTS:
        raise RobotModelError(f"robot {model.name}: {n} joints; arms of up to {MOST_JOINTS} are identified")
    axis, revolute = np.zeros((n, 3)), np.zeros(n, dtype=bool)
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for j in range(n):
        joint, name = model.joints[j + 1], model.names[j + 1]
        if model.parents[j + 1] != j:
            raise RobotModelError(
                f"robot {model.name}: joint {name} branches off; only serial arms are supported; {NAME_IT}"
            )
        axis[j], revolute[j] = _axis(joint, name)
        if joint.nq == 1:  # an unbounded revolute joint is stored as cosine and sine, without limits
            lower[j], upper[j] = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        if lower[j] > upper[j]:
            raise RobotModelError(f"joint {name}: its range is reversed: from {lower[j]:.6g} to {upper[j]:.6g}")
        R = model.jointPlacements[j + 1].rotation
        if not np.abs(R @ R.T - np.eye(3)).max() < NOT_TURNED:
            raise RobotModelError(f"joint {name}: its body has no orientation; check its axes and angles")
    stated = (lower < upper) & (np.abs(lower) < 1e3) & (np.abs(upper) < 1e3)
    return Arm(
        name=model.name,
        joint_names=tuple(model.names[1:]),
        rotation=readonly([model.jointPlacements[j + 1].rotation for j in range(n)]),
        translation=readonly([model.jointPlacements[j + 1].translation for j in range(n)]),
        axis=readonly(axis),
        revolute=readonly(revolute),
        gravity=readonly(model.gravity.linear),
        lower=readonly(np.where(stated, lower, -np.inf)),
        upper=readonly(np.where(stated, upper, np.inf)),
    )


def _axis(joint: "pin.JointModel", name: str) -> tuple[Array, bool]:
    """Return the unit axis in the joint's frame and whether the joint is revolute."""
    kind = joint.shortname()
    if joint.nv == 1 and kind.startswith(("JointModelR", "JointModelP")):
        data = joint.createData()
        joint.calc(data, np.array([1.0, 0.0]) if joint.nq == 2 else np.zeros(1))
        linear, angular = np.asarray(data.S).reshape(2, 3)
        if linear.any() != angular.any():
            return (angular, True) if angular.any() else (linear, False)
        raise RobotModelError(f"joint {name}: its axis has no direction")
    raise RobotModelError(f"joint {name}: type {kind} is not supported; use revolute or prismatic joints")
