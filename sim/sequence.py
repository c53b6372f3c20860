"""Motions of one robot, one after another: how warm its drives are when each begins.

Drives that do not warm up have no memory from motion to motion, and their motions may run side by side. A warm-up is
not simulated from end to end: drives that take minutes to warm up feel the mean of I^2 R. It is taken from one motion
with cold drives until half the time, and from another with those of half the time for the whole (the midpoint rule).
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ident.support.arrays import Array
from sim.effects import temperature
from sim.errors import SequenceError, SimulationError
from sim.experiment import Experiment
from sim.sensors import SensorOptions


def is_carried(experiment: Experiment) -> bool:
    """Whether its robot's drives warm up, so that what came before matters."""
    return temperature.varies(experiment.plant.errors)


def waves(experiments: Sequence[Experiment]) -> list[list[int]]:
    """Numbers of experiments that may run side by side, each wave after the ones before."""
    found: dict[int, list[int]] = defaultdict(list)
    for i, experiment in enumerate(experiments):
        found[experiment.earlier if is_carried(experiment) else 0].append(i)
    return [found[k] for k in sorted(found)]


def starts_warm(experiment: Experiment) -> bool:
    """Whether it is a first motion behind a warm-up that matters."""
    return is_carried(experiment) and experiment.earlier == 0 and experiment.warm_up > 0.0


def warming_motion(experiment: Experiment) -> Experiment:
    """What a robot does to warm up before a motion: the same with a bare flange, and nobody looks."""
    return replace(experiment, name=f"warm-up before {experiment.name}", loaded=False, sensors=SensorOptions())


def after_warm_up(experiment: Experiment, v: Array, share: float) -> Array:
    """Temperature rise after a share of a warm-up of cold drives [K], shape (n,).

    Args:
        experiment: The motion that is repeated.
        v: Its currents [drive units], shape (N, n).
        share: Of the time.
    """
    load = np.mean((v / experiment.plant.drives.current_limit) ** 2, axis=0)
    return temperature.warmed(experiment.plant.errors, np.zeros(v.shape[1]), load, share * experiment.warm_up)


def warmth_before(
    experiments: Sequence[Experiment], i: int, ended: Mapping[int, Array | SimulationError]
) -> Array | SimulationError | None:
    """Temperature rise of the drives when a motion begins [K], shape (n,); None if it does not matter or they are cold.

    Args:
        experiments: In order of time for each robot.
        i: The motion.
        ended: How warm earlier motions left the drives, or why they did not.

    Raises:
        SequenceError: If the motion before is not there.
    """
    experiment = experiments[i]
    if not is_carried(experiment) or not experiment.earlier:
        return None
    if i == 0 or experiments[i - 1].earlier != experiment.earlier - 1 or i - 1 not in ended:
        raise SequenceError(
            f"{experiment.name}: motion {experiment.earlier + 1}: drives warm up, but the preceding "
            "motion is missing; pass all motions in order of time"
        )
    before = ended[i - 1]
    if isinstance(before, SimulationError):
        return before
    return temperature.warmed(experiment.plant.errors, before, np.zeros_like(before), experiment.pause)
