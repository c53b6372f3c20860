"""A state of the arm, currents, and simulations of plants from rest there."""

import numpy as np
from plants import nominal_plant

from sim.compile import plant_model, resting
from sim.engine import Simulation
from sim.plant import Plant
from sim.varying import varied

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
