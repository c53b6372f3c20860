"""Sequences of motions of one robot: temperature of the drives at the start of each.

Motions of drives that do not warm up are independent and may run in parallel. A warm-up is not simulated completely:
drives that warm up within minutes respond to the mean of I^2 R. It is computed with the midpoint rule: one motion with
cold drives gives the load for the first half, and a motion with the drives at the temperature after this half gives the
load for the whole warm-up.
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
    """Return whether the robot's drives warm up, so that earlier motions have an effect."""
    return temperature.varies(experiment.plant.errors)


def waves(experiments: Sequence[Experiment]) -> list[list[int]]:
    """Return groups of experiments that may run in parallel, in order of execution."""
    found: dict[int, list[int]] = defaultdict(list)
    for i, experiment in enumerate(experiments):
        found[experiment.earlier if is_carried(experiment) else 0].append(i)
    return [found[k] for k in sorted(found)]


def starts_warm(experiment: Experiment) -> bool:
    """Return whether it is a first motion after a warm-up that has an effect."""
    return is_carried(experiment) and experiment.earlier == 0 and experiment.warm_up > 0.0


def warming_motion(experiment: Experiment) -> Experiment:
    """Return the warm-up motion of an experiment: the same motion with a bare flange, not recorded."""
    return replace(experiment, name=f"warm-up before {experiment.name}", loaded=False, sensors=SensorOptions())


def after_warm_up(experiment: Experiment, v: Array, share: float) -> Array:
    """Return the temperature rise of cold drives after a share of a warm-up [K], shape (n,).

    Args:
        experiment: The motion that is repeated.
        v: Currents of the motion [drive units], shape (N, n).
        share: Share of the warm-up time.
    """
    load = np.mean((v / experiment.plant.drives.current_limit) ** 2, axis=0)
    return temperature.warmed(experiment.plant.errors, np.zeros(v.shape[1]), load, share * experiment.warm_up)


def warmth_before(
    experiments: Sequence[Experiment], i: int, ended: Mapping[int, Array | SimulationError]
) -> Array | SimulationError | None:
    """Return the temperature rise at the start of a motion [K], shape (n,); None if cold or without effect.

    Args:
        experiments: In order of time for each robot.
        i: The motion.
        ended: Final temperature rise of the earlier motions, or their errors.

    Raises:
        SequenceError: If the preceding motion is missing.
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
