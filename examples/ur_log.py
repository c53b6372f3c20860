"""Logs as an RTDE client of a UR10e would have written them, from a simulated one, with all that goes with them.

Written into the working folder: bare.csv, heavy.csv and other.csv, one motion each; heavy.toml and other.toml, the
weights of two of them; arm.urdf, the arm's kinematics; sheet.toml, the gains that its efforts come from.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ident import load_arm
from ident.payload.payload import write_payload
from scenarios import load
from scenarios.experiments.robots import robot

SCENARIO = """extends = "ur10e"
[plant.payloads]
heavy = { mass = 8.0, com = [0.1, 0.07, 0.2], inertia = { ixx = 0.0325, iyy = 0.0325, izz = 0.0065 } }
other = { mass = 5.3, com = [0.06, -0.04, 0.16], inertia = { ixx = 0.02, iyy = 0.021, izz = 0.005 } }
[belief.payloads]
heavy = { mass = 8.0, com = [0.1, 0.07, 0.2], inertia = { ixx = 0.0325, iyy = 0.0325, izz = 0.0065 } }
other = { mass = 5.3, com = [0.06, -0.04, 0.16], inertia = { ixx = 0.02, iyy = 0.021, izz = 0.005 } }
[experiment]
protocol = ["bare", "heavy", "other"]
"""
SHEET = (12.0, 12.0, 10.0, 10.0, 10.0, 10.0)  # N m/A
EFFORT = 240.0  # N m, of every joint
NAMES = ["timestamp", *(f"actual_{kind}_{j}" for kind in ("q", "current") for j in range(6))]


def urdf() -> str:
    """The arm's kinematics, with efforts."""
    arm, text = load_arm(robot("ur10e").model), '<link name="l0"/>'
    for j, name in enumerate(arm.joint_names):
        rpy = Rotation.from_matrix(arm.rotation[j]).as_euler("xyz")
        x, rpy, axis = (" ".join(map(repr, each.tolist())) for each in (arm.translation[j], rpy, arm.axis[j]))
        text += (
            f'<link name="l{j + 1}"/><joint name="{name}" type="revolute"><parent link="l{j}"/><child link="l{j + 1}"/>'
            f'<origin xyz="{x}" rpy="{rpy}"/><axis xyz="{axis}"/>'
            f'<limit lower="-6.28" upper="6.28" effort="{EFFORT}" velocity="3"/></joint>\n'
        )
    return f'<robot name="ur10e">{text}</robot>\n'


def main() -> None:
    """Write everything."""
    Path("cell.toml").write_text(SCENARIO)
    simulated = load("cell.toml").simulate(seed=11)
    setup = simulated.setup
    for name, log in zip(setup.protocol, simulated.recordings, strict=True):
        rows = np.column_stack((1e4 + log.t, log.q, log.v))[::2]  # 500 Hz
        np.savetxt(f"{name}.csv", rows, fmt="%.9f", header=" ".join(NAMES), comments="")
    for name, payload in setup.payloads.items():
        write_payload(payload, Path(f"{name}.toml"))
    Path("arm.urdf").write_text(urdf())
    entries = [f"[[gains]]\njoint = {j}\nestimate = {gain}\nstd = 0.0\n" for j, gain in enumerate(SHEET, 1)]
    Path("sheet.toml").write_text("\n".join(entries))


if __name__ == "__main__":
    main()
