"""What each model error adds to a physics step, printed as ratios; run by `make bench`.

A control period of one step of the closed loop's engine with the effect, over one without any, taken in turn.
"""

import statistics
import sys
import time

from scenarios.experiments.scenario import load_scenario
from scenarios.experiments.setup import setup_of
from sim.compile import lean_model, resting
from sim.effects import ModelErrors
from sim.engine import Engine, Simulation
from sim.plant import Plant
from sim.varying import varied

PERIODS, RUNS = 400, 9
COMPLIANCE = (1e-5, 1e-5, 3e-5, 4e-5, 6e-5, 1.2e-4)
EFFECTS = {
    "no effect, again": ModelErrors(),
    "tilted base": ModelErrors(base_tilt_x=0.01),
    "moved frames": ModelErrors(d3_error=0.001),
    "drift": ModelErrors(coulomb_drift=0.02),
    "gravity spring": ModelErrors(gravity_spring=2e3),
    "wrist coupling": ModelErrors(wrist_coupling=1.0),
    "elastic joints": ModelErrors(joint_compliance=COMPLIANCE),
    "elastic joints with backlash": ModelErrors(joint_compliance=COMPLIANCE, backlash=3e-4),
    "Stribeck friction": ModelErrors(stribeck=0.2),
    "friction by direction": ModelErrors(viscous_by_direction=0.1),
    "load friction, motor torque": ModelErrors(load_friction=0.05),
    "load friction, transmitted torque": ModelErrors(transmitted_friction=0.05),
    "temperature": ModelErrors(motor_warming=200.0, viscous_by_temperature=-0.01),
    "curve of viscous friction": ModelErrors(viscous_curve=0.5),
    "cogging and ripple": ModelErrors(cogging=0.003, torque_ripple=0.02),
    "presliding": ModelErrors(presliding=3e-4),
}


def engine_with(errors: ModelErrors, simulations: int) -> Engine:
    """Simulations of one plant at rest, each with a model of its own."""
    first = setup_of(load_scenario("nominal")).experiments[0]
    plant = Plant(robot=first.plant.robot, drives=first.plant.drives, payload=first.plant.payload, errors=errors)
    entries: list[Simulation] = []
    for _ in range(simulations):
        model = lean_model(plant, loaded=True, step=1e-3)
        acting = varied(plant, model, step=1e-3, earlier=0)
        entries.append(Simulation(model=model, start=resting(plant, model, first.trajectory.center), varied=acting))
    return Engine(entries, substeps=1, threads=1)


def seconds(engine: Engine) -> float:
    """Wall time of some periods of small currents [s]."""
    engine.current[:] = 2.0
    started = time.perf_counter()
    for _ in range(PERIODS):
        engine.advance()
    return time.perf_counter() - started


def main(simulations: int) -> None:
    """Print the ratio of each effect for a batch of some size."""
    for name, errors in EFFECTS.items():
        ratios: list[float] = []
        for _ in range(RUNS):
            plain, other = engine_with(ModelErrors(), simulations), engine_with(errors, simulations)
            ratios.append(seconds(other) / seconds(plain))
        low, high = min(ratios), max(ratios)
        print(f"{name}, {simulations} simulations: {statistics.median(ratios):.2f} of plain ({low:.2f} to {high:.2f})")


if __name__ == "__main__":
    for count in map(int, sys.argv[1:] or ("1", "32")):
        main(count)
