"""Accelerations of a plant in MuJoCo, and what its drives give there as it is written."""

import mujoco
import numpy as np
from drive_states import V
from plants import RX90

from sim.compile import plant_model
from sim.plant import Plant

STEP = 1e-3
SOLVER = 1e-6
"""Torque [N m] that the friction solver leaves at its default tolerance, as in test_model."""


def acceleration(plant: Plant, q: np.ndarray, dq: np.ndarray, *, loaded: bool = False) -> np.ndarray:
    model = plant_model(plant, loaded=loaded, step=STEP)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, dq, V
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


def drive_torque(plant: Plant, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """What the drives give after rotors and friction [N m]."""
    d = plant.drives
    torque = d.gain * (V - d.amplifier_offset) - d.coulomb_asymmetry - d.rotor_inertia * ddq
    return torque - d.viscous_friction * dq - d.coulomb_friction * np.sign(dq)


def coupling(share: float, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque that motor 6 costs because it turns with q5 + q6, less what it costs turning with q6 [N m]."""
    inertia, viscous, coulomb = RX90.drives.rotor_inertia[5], 2.4, 2.5
    dry = coulomb * np.sign(dq[4] + dq[5])
    cost = np.zeros(6)
    cost[4] = inertia * ddq[5] + viscous * dq[5] + dry
    cost[5] = inertia * ddq[4] + viscous * dq[4] + dry - coulomb * np.sign(dq[5])
    return share * cost
