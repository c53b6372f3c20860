"""A state of the arm and currents: accelerations there in MuJoCo, what drives give, simulations from rest."""

import mujoco
import numpy as np
from plants import RX90, nominal_plant

from sim.engine import Simulation, varied
from sim.plant import Plant, plant_model, resting

Q = np.array([0.4, -0.3, 1.1, 0.7, 0.9, 0.2])
DQ = np.array([0.8, -1.1, 0.6, 1.4, -0.9, 1.2])
V = np.array([20.0, -35.0, 12.0, 6.0, -9.0, 4.0])
DRIVES = nominal_plant().drives
COMPLIANCE = (2e-5, 2.5e-5, 6e-5, 1e-4, 1.2e-4, 2e-4)
TURNS = np.vstack((np.eye(6), [0, 0, 0, 0, 1, 1]))
"""Speeds that friction rubs at: six joints, and motor 6 with q5 + q6."""


def simulation_of(plant: Plant, *, step: float, earlier: int = 0) -> Simulation:
    """A loaded plant at rest at `Q`, with what varies of it."""
    model = plant_model(plant, loaded=True, step=step, earlier=earlier)
    acting = varied(plant, model, step=step, earlier=earlier)
    return Simulation(model=model, start=resting(plant, model, Q), varied=acting)


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
