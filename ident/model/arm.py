"""A fixed-base serial arm and its model file, MJCF or URDF, read through Pinocchio.

Identification needs only the joint axes, no nominal inertias, so an `Arm` has only these, and `minimal_model` reduces a
file to them.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ident.model.mjcf import NAME_IT, MinimalModel, minimal_mjcf
from ident.model.urdf import minimal_urdf
from ident.model.xml_tree import read_xml, title, where
from ident.support.arrays import Array, numbers, readonly, transmission_fault
from ident.support.errors import RobotModelError, placed
from ident.support.files import captured_stderr
from ident.support.naming import enumerated, one_line, shown

if TYPE_CHECKING:
    import pinocchio as pin  # pyright: ignore[reportMissingImports]  (its wheel installs beside site-packages)

MOST_JOINTS = 24
"""Largest number of joints of an arm; the computing time grows with its fourth power and is seconds here."""
FARTHEST = 50.0
"""Largest plausible distance between neighbouring joints along an axis [m]."""
STRONGEST_GRAVITY = 100.0
"""Largest plausible gravity [m/s^2]."""
EXPAND = "this is a xacro template; run xacro first, and give the file that it writes"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
        transmission: Matrix A of motors that several joints turn, shape (n, n); None if each joint has its own. All
            positions, torques and gains are those of the motors: q_motor = A q, torque of the joints = A' torque.
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
    transmission: Array | None = None

    def __repr__(self) -> str:
        """Return name and joints."""
        return f"Arm {self.name!r}: {', '.join(self.joint_names)}"

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @property
    def to_joints(self) -> Array | None:
        """Matrix from positions of motors to those of joints, A^-1, shape (n, n); None without a transmission."""
        return None if self.transmission is None else np.asarray(np.linalg.inv(self.transmission), np.float64)

    def of_motors(self, torque: Array) -> Array:
        """Convert torques of the joints, shape (N, n, ...), to those of the motors, A'^-1 times them."""
        through = self.to_joints
        return torque if through is None else np.einsum("ji,sj...->si...", through, torque)


def with_transmission(arm: Arm, A: Array) -> Arm:
    """Return an arm with motors that several joints turn, q_motor = A q, A of shape (n, n).

    Its position limits are the ends of what the motors can reach. Raises `RobotModelError` if A is not an invertible
    matrix of the arm's size, or a motor turns joints of both kinds.
    """
    try:
        A = np.atleast_1d(numbers(A))
    except ValueError as error:
        raise RobotModelError(f"transmission: {error}") from error
    if fault := transmission_fault(A, arm.n, coupled=bool(arm.couplings)):
        raise RobotModelError(f"transmission: {fault}")
    turns = np.asarray(arm.revolute, np.bool_)
    if A[turns[:, None] != turns].any():
        raise RobotModelError("transmission: row i must be of joints of the kind of joint i, revolute or prismatic")
    with np.errstate(invalid="ignore"):  # 0 times a limit that is not stated
        ends = np.nan_to_num(A * np.stack((arm.lower, arm.upper))[:, None], nan=0.0, posinf=np.inf, neginf=-np.inf)
    lower, upper = ends.min(axis=0).sum(axis=1), ends.max(axis=0).sum(axis=1)
    return replace(arm, transmission=readonly(A), lower=readonly(lower), upper=readonly(upper))


def load_arm(
    path: str | Path,
    couplings: tuple[tuple[int, int], ...] = (),
    *,
    flange: str | None = None,
    transmission: Array | None = None,
) -> Arm:
    """Read an arm from an MJCF (`.xml`, `.mjcf`) or URDF (`.urdf`) file.

    Args:
        path: The model file. Meshes are not read.
        couplings: Pairs of coupled joints, from 0, which model files do not state.
        flange: Last body of the arm; joints outside the chain to it are locked at their initial positions. None if all
            joints belong to the arm.
        transmission: Matrix A of `with_transmission`, None if each joint has a motor of its own.

    Raises:
        RobotModelError: If the file is missing, unreadable, or not a fixed-base serial arm of revolute
            and prismatic joints, a coupling names a joint that does not exist, or the transmission is not possible.
    """
    arm, minimal = load_joints(path, couplings, flange=flange)
    if transmission is not None:
        return with_transmission(arm, transmission)
    check_own_motors(arm, minimal)
    return arm


def load_joints(
    path: str | Path, couplings: tuple[tuple[int, int], ...] = (), *, flange: str | None = None
) -> tuple[Arm, MinimalModel]:
    """As `load_arm`, whatever motors turn the joints; also returns the reduced file."""
    if not isinstance(path, str | Path):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise RobotModelError(f"the robot model is {type(path).__name__}; expected the path of an MJCF or URDF file")
    minimal = minimal_model(Path(path), flange)
    model = load_pinocchio(minimal, path)
    with placed(f"robot model {one_line(path)}"):
        return arm_from_pinocchio(model, couplings), minimal


def fixed_frame(path: Path, arm: Arm, body: str) -> tuple[Array, Array]:
    """Return orientation and origin [m], in the last frame of an arm, of a body of its file fixed to the last link.

    Raises `RobotModelError` if there is no such body.
    """
    import pinocchio as pin  # pyright: ignore[reportMissingImports]

    model = load_pinocchio(minimal_model(path, body), path)
    if tuple(model.names[1:]) != arm.joint_names:
        raise RobotModelError(f"robot model {one_line(path)}: {shown(body)} is not fixed to the last link of the arm")
    place = model.frames[model.getFrameId(body, pin.FrameType.BODY)].placement
    return np.array(place.rotation), np.array(place.translation)


def check_own_motors(arm: Arm, minimal: MinimalModel) -> None:
    """Refuse, by `RobotModelError`, an arm whose file has motors that turn several joints, unless couplings do so."""
    stated = [{arm.joint_names[k] for k in pair} for pair in arm.couplings]
    for motor, ratios in minimal.shared.items():
        alone = sum(each.keys() == ratios.keys() for each in minimal.shared.values()) == 1
        if not (alone and set(ratios) in stated and len(set(ratios.values())) == 1):
            raise RobotModelError(
                f"{motor}: it moves joints {enumerated(list(ratios))} together; state the matrix `transmission` in a "
                "robot.toml (rx90 new-robot writes one, of a URDF without this element), or --coupling I J for "
                "friction at the sum of two speeds"
            )


def stated_transmission(minimal: MinimalModel, joints: Sequence[str]) -> Array | None:
    """Return the matrix of the motors on fixed tendons of an MJCF, shape (n, n); None without any, or for more motors.

    A motor has the row of the first of its joints that has neither a motor of its own nor one of the tendons before.
    """
    A, free = np.eye(len(joints)), [name for name in joints if name not in minimal.own]
    for ratios in minimal.shared.values() if minimal.kind == "mjcf" else ():
        if (mine := next((name for name in ratios if name in free), None)) is None:
            return None
        free.remove(mine)
        A[joints.index(mine)] = [ratios.get(name, 0.0) for name in joints]
    return A if minimal.kind == "mjcf" and minimal.shared else None


def load_pinocchio(minimal: MinimalModel, path: str | Path) -> "pin.Model":
    """Return the Pinocchio model of a reduced file, without masses; `path` is for messages of `RobotModelError`."""
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


def arm_from_pinocchio(model: "pin.Model", couplings: tuple[tuple[int, int], ...] = ()) -> Arm:
    """Take the kinematics of a Pinocchio model; raises `RobotModelError` unless it is a plausible serial arm."""
    n, names = model.njoints - 1, tuple(model.names[1:])
    if n < 1:
        raise RobotModelError(f"robot {model.name}: it has no moving joint")
    if n > MOST_JOINTS:
        raise RobotModelError(f"robot {model.name}: {n} joints; arms of up to {MOST_JOINTS} are identified; {NAME_IT}")
    axis, revolute = np.zeros((n, 3)), np.zeros(n, dtype=bool)
    lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
    for j, name in enumerate(names):
        joint, place = model.joints[j + 1], model.jointPlacements[j + 1]
        if model.parents[j + 1] != j:
            raise RobotModelError(
                f"robot {model.name}: joint {name} branches off; only serial arms are supported; {NAME_IT}"
            )
        axis[j], revolute[j] = _axis(joint, name)
        if joint.nq == 1:  # an unbounded revolute joint is stored as cosine and sine, without limits
            lower[j], upper[j] = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        if lower[j] > upper[j]:
            raise RobotModelError(f"joint {name}: its range is reversed: from {lower[j]:.6g} to {upper[j]:.6g}")
        if not np.abs(place.rotation @ place.rotation.T - np.eye(3)).max() < 1e-6:
            raise RobotModelError(f"joint {name}: its body has no orientation; check its axes and angles")
        if not np.all(np.abs(place.translation) <= FARTHEST):
            raise RobotModelError(
                f"joint {name} is at {' '.join(f'{x:g}' for x in place.translation)} m from the one before, beyond "
                f"{FARTHEST:g}; check the numbers and their unit"
            )
    weight = float(np.linalg.norm(model.gravity.linear))
    if not weight:
        raise RobotModelError("gravity is 0 or disabled; without weight no gain can be identified")
    if weight > STRONGEST_GRAVITY:
        raise RobotModelError(f"gravity is {weight:g} m/s^2, beyond {STRONGEST_GRAVITY:g}; check the number")
    if len(set(couplings)) < len(couplings):
        raise RobotModelError("a coupling is given twice")
    for first, second in couplings:
        if not 0 <= first < second < n:
            raise RobotModelError(
                f"cannot couple joints {first + 1} and {second + 1}; expected two of its {n} joints, the one "
                "nearer to the base first"
            )
    stated = (lower < upper) & (np.abs(lower) < 1e3) & (np.abs(upper) < 1e3)
    return Arm(
        name=model.name,
        joint_names=names,
        rotation=readonly([model.jointPlacements[j + 1].rotation for j in range(n)]),
        translation=readonly([model.jointPlacements[j + 1].translation for j in range(n)]),
        axis=readonly(axis),
        revolute=readonly(revolute),
        gravity=readonly(model.gravity.linear),
        lower=readonly(np.where(stated, lower, -np.inf)),
        upper=readonly(np.where(stated, upper, np.inf)),
        couplings=couplings,
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


MODEL_FILES = {".urdf": "robot", ".xml": "mujoco", ".mjcf": "mujoco"}
"""Root elements by the ending of a file's name."""
OTHERS = {"robot": "MJCF files end in .xml or .mjcf", "mujoco": "URDF files end in .urdf"}


def minimal_model(path: Path, flange: str | None = None) -> MinimalModel:
    """Reduce a model file to its kinematics, other joints than those to a flange locked; raises `RobotModelError`."""
    check_ending(path)
    root = read_xml(path)
    for element in root.iter():
        left = next((value for value in element.attrib.values() if "${" in value), None)
        if left is not None or element.tag.startswith("xacro:"):
            raise RobotModelError(f"{title(element)}: {'' if left is None else f'{shown(left)}: '}{EXPAND}")
    if root.tag != (wanted := MODEL_FILES[path.suffix.lower()]):
        raise RobotModelError(f"{where(root)}: the root element is {root.tag}, expected {wanted}; {OTHERS[wanted]}")
    return minimal_urdf(root, path, flange) if wanted == "robot" else minimal_mjcf(root, path, flange)


def check_ending(path: Path) -> None:
    """Check that a file's name has the ending of a robot model; raises `RobotModelError` otherwise."""
    ending = path.suffix.lower()
    if ending not in MODEL_FILES:
        what = EXPAND if ending == ".xacro" else "expected a .urdf, .xml or .mjcf file"
        raise RobotModelError(f"robot model {one_line(path)}: {what}")
