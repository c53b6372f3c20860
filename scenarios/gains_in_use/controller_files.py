"""What people put into a robot's controller, one function a format: the load on the flange, parameters of ROS 2.

Loads are in the controller's flange frame, with the inertia about the centre of mass in the axes of this frame:

- Universal Robots, script manual, `set_target_payload(m, cog, inertia)`: mass [kg]; centre of gravity from the tool
  mount [m]; Ixx, Iyy, Izz, Ixy, Ixz, Iyz [kg m^2], with origin in the centre of gravity and the axes of the tool
  flange, a zero matrix if left out.
- Franka, libfranka, `Robot::setLoad(load_mass, F_x_Cload, load_inertia)`: mass [kg]; centre of mass in the flange frame
  [m]; inertia matrix about the centre of mass [kg m^2], column-major. Desk has the same numbers in the keys mass,
  centerOfMass and inertia of an endeffector-config.json, and franka_msgs/SetLoad has the arguments of setLoad.

ROS 2 parameters are torque constants of joints, and effort limits by the names of ros2_control's package joint_limits.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ident.payload.payload import Payload, inertia_matrix
from ident.support.arrays import Array
from scenarios.results.gains_file import TURNING, GainsFile


def in_frame(load: Payload, rotation: Array, origin: Array) -> Payload:
    """Return a payload without standard deviations in a frame of the last link, of this orientation and origin [m]."""
    x, y, z = (rotation.T @ (np.array(load.com) - origin)).tolist()
    moved = replace(load, com=(x, y, z), com_std=(0.0,) * 3, inertia_std=(0.0,) * 6)
    if load.inertia is None:
        return moved
    J = (rotation.T @ inertia_matrix(load.inertia) @ rotation).tolist()
    return replace(moved, inertia=(J[0][0], J[1][1], J[2][2], J[0][1], J[0][2], J[1][2]))


def urscript(load: Payload, frame: str) -> str:
    """Return a line of URScript, which leaves out an unknown inertia."""
    assert load.com is not None, "of a load with its centre"
    parts = [load.com] if load.inertia is None else [load.com, load.inertia]
    lists = ", ".join(f"[{', '.join(f'{x:.9f}' for x in part)}]" for part in parts)
    return f"# load in the frame of {frame} [kg, m, kg m^2]\nset_target_payload({load.mass:.9f}, {lists})\n"


def franka(load: Payload, frame: str) -> str | None:
    """Return the arguments of setLoad as JSON, in which the frame has no place; None without an inertia."""
    if load.inertia is None:
        return None
    inertia = inertia_matrix(load.inertia).ravel(order="F").tolist()
    return json.dumps({"load_mass": load.mass, "F_x_Cload": load.com, "load_inertia": inertia}, indent=2) + "\n"


LOADS: dict[str, Callable[[Payload, str], str | None]] = {".script": urscript, ".json": franka}
"""Formats of loads by the ending of the file's name."""


def ros_parameters(file: GainsFile, names: tuple[str, ...], efforts: Mapping[str, float]) -> str:
    """Return a ROS 2 parameter file (YAML) of torque constants, and of effort limits [N m, N] by joint.

    Refused joints are named in a comment only.
    """
    named = [(json.dumps(name), entry) for name, entry in zip(names, file.gains, strict=True)]
    others = [f"; {name}: {entry.unit}" for name, entry in named if entry.unit != TURNING]
    lines = [
        "# Joint torque (force) per drive unit, joint side: effort = torque_constant * current reference.",
        f"# {TURNING}{''.join(others)}",
        "/**:",
        "  ros__parameters:",
    ]
    for key, field in (("torque_constants", "estimate"), ("torque_constant_deviations", "std")):
        numbers = {name: getattr(entry, field) for name, entry in named}
        entries = [f"      {name}: {float(value)!r}" for name, value in numbers.items() if value is not None]
        lines += [f"    {key}:" if entries else f"    {key}: {{}}", *entries]
    lines += ["    joint_limits:"] if efforts else []
    for name, effort in efforts.items():
        lines.append(f"      {json.dumps(name)}: {{has_effort_limits: true, max_effort: {effort!r}}}")
    lines += [f"    # {words}" for entry in file.gains for words in entry.words]
    refused = {name: entry.reason or "refused" for name, entry in named if entry.estimate is None}
    lines += [f"    # {name}: {' '.join(reason.split())}" for name, reason in refused.items()]
    return "\n".join(lines) + "\n"
