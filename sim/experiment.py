"""An experiment: one motion of one plant, with its controller and sensors."""

from dataclasses import dataclass

from sim.controller import ControllerBelief, ControllerOptions
from sim.errors import StepError, TooLong
from sim.plant import Plant
from sim.sensors import SensorOptions
from sim.trajectory import FourierTrajectory

MOST_STEPS = 5e7
"""Largest number of physics steps of a motion; they take some minutes."""
MOST_NUMBERS = 5e7
"""Largest number of samples times joints of a motion; tables, noise and log then take 5 GB."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment:
    """One motion of one plant.

    Attributes:
        name: For messages and the recording.
        plant: The truth.
        loaded: Whether the plant's payload is mounted.
        trajectory: Reference motion.
        belief: The controller's model of the arm.
        controller: Its tuning.
        sensors: Noise and timing.
        step: Physics step [s]; the control period is a multiple of it.
        earlier: Number of earlier motions of the robot; friction may drift between motions, and drives stay warm.
        warm_up: Duration for which the motion was repeated with a bare flange before the first motion [s].
        pause: Rest before this motion [s], unless it is the first.
    """

    name: str
    plant: Plant
    loaded: bool
    trajectory: FourierTrajectory
    belief: ControllerBelief
    controller: ControllerOptions
    sensors: SensorOptions
    step: float
    earlier: int = 0
    warm_up: float = 0.0
    pause: float = 0.0


def substeps(experiment: Experiment) -> int:
    """Return the number of physics steps per control period, and check the size of the experiment.

    Raises:
        StepError: If the step does not divide the period.
        TooLong: If the motion has too many steps or samples.
    """
    rate, step, duration = experiment.controller.rate_hz, experiment.step, experiment.trajectory.duration
    if not step > 0.0:
        raise StepError(f"step = {step:g} s: expected a positive number")
    if duration / step > MOST_STEPS:
        raise TooLong(
            f"{experiment.name}: {duration:g} s in steps of {step:g} s are {duration / step:.2g} steps; "
            f"{MOST_STEPS:g} at most; use a larger step or a shorter motion"
        )
    if duration * rate * experiment.plant.robot.n > MOST_NUMBERS:
        raise TooLong(
            f"{experiment.name}: {duration:g} s at {rate:g} Hz are {duration * rate:.2g} samples of "
            f"{experiment.plant.robot.n} joints; {MOST_NUMBERS:g} numbers at most; use a lower rate or a shorter motion"
        )
    ratio = 1.0 / (rate * step)
    if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6:
        raise StepError(f"step {step:g} s does not divide the control period {1.0 / rate:g} s")
    return round(ratio)
