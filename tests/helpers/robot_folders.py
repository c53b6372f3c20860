"""Folders of invented robots: a serial arm of any number of joints and its robot file."""

from pathlib import Path

import numpy as np

ORIGIN = 'origin = "assumed"\nsource = "invented"\n'


def arm_xml(joints: int, *, extra: str = "") -> str:
    """A serial arm, every other axis horizontal, without drives."""
    text = ""
    for j in range(joints):
        axis = "0 0 1" if j % 2 == 0 else "0 1 0"
        mass, reach = 9.0 / (1.0 + 0.7 * j), 0.31 / (1.0 + 0.2 * j)
        text += (
            f'<body name="part{j + 1}" pos="0.02 0 {reach:.3f}">'
            f'<inertial pos="0.01 -0.02 {0.4 * reach:.3f}" mass="{mass:.3f}" '
            f'fullinertia="{0.02 * mass:.4f} {0.03 * mass:.4f} {0.015 * mass:.4f} 0.001 0 -0.002"/>'
            f'<joint name="axis{j + 1}" axis="{axis}" range="-2.9 2.9"/>'
        )
    return (
        '<mujoco><compiler angle="radian" autolimits="true"/>'
        f"<worldbody>{text}{'</body>' * joints}</worldbody>{extra}</mujoco>"
    )


def drives(joints: int) -> dict[str, list[float]]:
    """Lopsided drives by name."""
    weight = 1.0 / (1.0 + 0.5 * np.arange(joints))
    values = {
        "gain": 0.8 + 0.11 * np.arange(joints),
        "rotor_inertia": 1.3 * weight,
        "viscous_friction": 7.0 * weight,
        "coulomb_friction": 3.1 * weight,
        "coulomb_asymmetry": 0.2 * weight,
        "amplifier_offset": -0.3 * weight,
        "current_limit": 400.0 * weight,
        "max_velocity": 3.0 + 0.3 * np.arange(joints),
        "max_acceleration": 11.0 + 2.0 * np.arange(joints),
    }
    return {name: array.tolist() for name, array in values.items()}


def robot_folder(folder: Path, joints: int, *, extra: str = "", model_extra: str = "") -> Path:
    """Write `arm.xml` and `robot.toml`, and return the latter's path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.xml").write_text(arm_xml(joints, extra=model_extra))
    lines = ['name = "invented"', 'model = "arm.xml"', "[home]"]
    lines.append(f"value = {(0.3 - 0.07 * np.arange(joints)).tolist()}\n{ORIGIN}")
    lines += [f"[drives.{name}]\nvalue = {values}\n{ORIGIN}" for name, values in drives(joints).items()]
    path = folder / "robot.toml"
    path.write_text("\n".join([*lines, extra]))
    return path
