"""Torque constants as a ROS 2 parameter file: YAML, joints by name."""

import json

from scenarios.experiments.gains_file import TURNING, GainsFile


def ros_parameters(file: GainsFile, names: tuple[str, ...]) -> str:
    """Return a parameter file for any node; refused joints are named in a comment and have no entry."""
    lines = [
        "# Joint torque (force) per drive unit, joint side: effort = torque_constant * current reference.",
        "# N m / drive unit" + "".join(
            f"; {json.dumps(name)}: {entry.unit}" for name, entry in zip(names, file.gains, strict=True)
            if entry.unit != TURNING
        ),
        "/**:",
        "  ros__parameters:",
    ]  # fmt: skip
    for key, field in (("torque_constants", "estimate"), ("torque_constant_deviations", "std")):
        entries = list[str]()
        for name, entry in zip(names, file.gains, strict=True):
            value = getattr(entry, field)
            if value is not None:
                entries.append(f"      {json.dumps(name)}: {float(value)!r}")
        lines += [f"    {key}:" if entries else f"    {key}: {{}}", *entries]
    for name, entry in zip(names, file.gains, strict=True):
        if entry.estimate is None:
            lines.append(f"    # {json.dumps(name)}: {' '.join((entry.reason or 'refused').split())}")
    return "\n".join(lines) + "\n"
