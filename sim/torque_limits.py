"""Whether drives bear what a motion asks of them, told from its reference alone."""

from collections.abc import Sequence
from dataclasses import replace

from sim.compile import bare_arm
from sim.effects import ModelErrors
from sim.errors import Saturated
from sim.experiment import Experiment
from sim.faults import SATURATED_TOO_LONG, first_at_limit
from sim.feedforward_currents import feedforward_currents

RATE = 100.0
"""Samples a second; ten make the time that is too long at a limit [Hz]."""


def check_torque_limits(experiments: Sequence[Experiment]) -> None:
    """Check that no drive needs its largest current for long, on an arm without model errors.

    Raises:
        Saturated: At the first motion in which one does.
        PlantError: If a plant cannot be compiled.
    """
    sound = [replace(e, plant=replace(e.plant, errors=ModelErrors())) for e in experiments]
    for e, v in zip(experiments, feedforward_currents(sound, RATE), strict=True):
        drives, robot = e.plant.drives, e.plant.robot
        over = first_at_limit(v, drives.current_limit, RATE)
        if over is None:
            continue
        name = bare_arm(robot.model, drives.rotor_inertia, robot.flange).joint(over.joint).name
        most, limit = float(abs(v[:, over.joint]).max()), drives.current_limit[over.joint]
        raise Saturated(
            f"{e.name}: drive of {name} would need up to {most:.4g} where its limit is {limit:g}, for more than "
            f"{SATURATED_TOO_LONG:g} s from t = {over.time:.2f} s; "
            + ("use a lighter payload or a slower motion" if e.loaded else "use a slower motion")
        )
