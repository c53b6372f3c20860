"""How an MJCF body is turned: five ways to say it, made one quaternion.

Pinocchio reads an axis that is no unit vector, and Euler angles about fixed axes, otherwise than MuJoCo; it is given
neither.
"""

import re
from dataclasses import dataclass

import numpy as np
import scipy

from ident.model.files.numbers import SHORTEST, direction, vector
from ident.model.files.xml_tree import Element
from ident.support.errors import RobotModelError
from ident.support.naming import nearest, shown

ORIENTATIONS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}
"""Attributes that turn a body, with their numbers."""
UNITS = ("degree", "radian")


@dataclass(frozen=True, slots=True)
class Angles:
    """How a file means its angles.

    Attributes:
        unit: "degree" or "radian".
        sequence: Axes of Euler angles, lower case for axes that turn with the body, upper case for fixed ones.
    """

    unit: str
    sequence: str


def angles_of(root: Element, compiler: dict[str, str]) -> Angles:
    """Unit and sequence that the compiler section states.

    Raises:
        RobotModelError: If there is no such unit or sequence.
    """
    unit, sequence = compiler.get("angle", "degree"), compiler.get("eulerseq", "xyz")
    if unit not in UNITS:
        raise RobotModelError(
            f"{root.title}: compiler angle = {shown(unit)}{nearest(unit, UNITS)}; known: degree, radian"
        )
    if not re.fullmatch("[xyz]{3}|[XYZ]{3}", sequence):
        expected = "expected three of x, y, z, all lower or all upper case"
        raise RobotModelError(f"{root.title}: compiler eulerseq = {shown(sequence)}; {expected}")
    return Angles(unit, sequence)


def orientation(body: Element, angles: Angles) -> dict[str, str]:
    """The attribute that turns a body, as Pinocchio reads it; none if the body is not turned.

    Raises:
        RobotModelError: If a number is wrong, a vector has no direction, or two attributes turn it.
    """
    stated = [key for key in ORIENTATIONS if key in body.attributes]
    if not stated:
        return {}
    if len(stated) > 1:
        raise RobotModelError(f"{body.title}: {' and '.join(stated)} both turn it; give one")
    key = stated[0]
    values = np.array(vector(body, key, ORIENTATIONS[key]))
    if key == "euler":
        return _quaternion(_euler(values, angles))
    if key == "axisangle":
        length = float(np.linalg.norm(values[:3]))
        if length < SHORTEST:
            raise RobotModelError(f"{body.title}: axisangle has no direction")
        angle = np.deg2rad(values[3]) if angles.unit == "degree" else values[3]
        return _quaternion(scipy.spatial.transform.Rotation.from_rotvec(values[:3] / length * angle))
    if key == "xyaxes" and np.linalg.norm(np.cross(values[:3], values[3:])) < SHORTEST:
        raise RobotModelError(f"{body.title}: the axes of xyaxes are parallel or zero")
    if key in ("quat", "zaxis"):
        direction(body, key, ORIENTATIONS[key])
    return {key: body.attributes[key]}


def _euler(values: np.ndarray, angles: Angles) -> "scipy.spatial.transform.Rotation":
    """SciPy writes fixed axes in lower case, MuJoCo in upper case."""
    return scipy.spatial.transform.Rotation.from_euler(
        angles.sequence.swapcase(), values, degrees=angles.unit == "degree"
    )


def _quaternion(rotation: "scipy.spatial.transform.Rotation") -> dict[str, str]:
    return {"quat": " ".join(repr(float(x)) for x in rotation.as_quat(scalar_first=True))}
