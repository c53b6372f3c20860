"""What a motion is designed against besides noise: the errors that a scenario's sources make along it.

Of every joint alone (eq. 27), at the rate of the search: the influence of each sample on 1/g, times the current that a
source adds. Sources that cost little along the motion at hand are left out of the search.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from ident.model.regressor import regressor
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array, Indices
from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.mountings import PAIR
from scenarios.experiments.files.schema import DrawTable, Scenario
from scenarios.experiments.files.settings import Value, with_settings
from scenarios.experiments.studies.sources import settings_with, sources_of
from scenarios.prediction.moments import points_of
from scenarios.support.errors import StudyError
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents
from sim.trajectory import FourierTrajectory

PLANT = "plant."
"""Beginning of the places of sources that add a current along the same motion."""
LEAST_SHARE = 0.1
"""Share of the costliest source's error that one must cost on some wanted joint to be searched against."""
NO_COST = 1e-9
"""Relative error of a gain that is rounding."""
REVERSAL = 0.1
"""Speed, as a share of a joint's rms, below which samples do not count."""

Added = Callable[[FourierTrajectory, float], Array]
"""Root mean square relative error of every gain from sources, of a motion at a rate, shape (n,)."""


def nothing_added(motion: FourierTrajectory, rate_hz: float) -> Array:
    """Of a design against noise alone."""
    return np.zeros(motion.n)


@dataclass(frozen=True, slots=True, eq=False)
class _Source:
    """Experiments that stand for a source.

    Attributes:
        name: Its name.
        mean: At the mean of its numbers.
        deviated: One deviation from there, one number after the other.
        equal: Of equal probability instead.
    """

    name: str
    mean: Sequence[Experiment]
    deviated: tuple[Sequence[Experiment], ...]
    equal: tuple[Sequence[Experiment], ...]


class Sourced:
    """The errors that the sources of a scenario make along a motion."""

    def __init__(self, scenario: Scenario, joints: Indices) -> None:
        """Prepare the plants.

        Args:
            scenario: With sources; of its protocol one bare and one loaded motion count.
            joints: Joints whose gains are wanted, from 0.

        Raises:
            StudyError: If the payload is called otherwise than `loaded`; if there are none, or none that counts.
            ScenarioError: If a source is wrong.
        """
        sources = sources_of(scenario)
        off = with_settings(scenario, settings_with(sources, {}).settings)
        self._quiet = setup_of(off)
        if not set(PAIR) <= set(self._quiet.protocol):
            raise StudyError(f"{scenario.name}: --against all needs a bare and a loaded motion in experiment.protocol")
        self._joints = joints
        self._drawn = [
            _source(name, source, off, self._quiet)
            for name, source in scenario.table.sources.items()
            if source.stream is None and all(place.startswith(PLANT) for place in source.targets)
        ]
        if not self._drawn:
            raise StudyError(
                f"{scenario.name}: it has no error source of the {PLANT[:-1]}; only noise remains, so leave "
                "out --against all"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Sources that count."""
        return tuple(source.name for source in self._drawn)

    def reduced(self, motion: FourierTrajectory, rate_hz: float) -> "Sourced":
        """The same with the sources alone that cost something along a motion.

        Raises:
            StudyError: If none does.
        """
        costs = [np.hypot(*each)[self._joints].max() for each in self._errors(motion, rate_hz)]
        least = max(LEAST_SHARE * max(costs), NO_COST)
        fewer = copy(self)
        fewer._drawn = [source for source, cost in zip(self._drawn, costs, strict=True) if cost > least]
        if not fewer._drawn:
            name = self._quiet.scenario.name
            raise StudyError(
                f"{name}: {', '.join(self.names)}: no effect on any wanted gain; only noise remains, so leave "
                "out --against all"
            )
        return fewer

    def __call__(self, motion: FourierTrajectory, rate_hz: float) -> Array:
        """Root mean square relative error of every gain, all sources together, shape (n,)."""
        errors = self._errors(motion, rate_hz)
        bias = np.sum([bias for bias, _ in errors], axis=0)
        return np.sqrt(bias**2 + np.sum([std**2 for _, std in errors], axis=0))

    def _errors(self, motion: FourierTrajectory, rate_hz: float) -> list[tuple[Array, Array]]:
        """Bias and deviation from each source, each (n,)."""
        base = self._currents(self._quiet.experiments, motion, rate_hz)
        influence = self._influence(motion, rate_hz)

        def error(experiments: Sequence[Experiment]) -> Array:
            inverse = 1.0 / self._quiet.true_gain
            for K, v, before in zip(influence, self._currents(experiments, motion, rate_hz), base, strict=True):
                inverse = inverse + np.sum(K * (v - before), axis=0)
            return 1.0 / (inverse * experiments[0].plant.drives.gain) - 1.0

        found = list[tuple[Array, Array]]()
        for source in self._drawn:
            if source.equal:
                errors = np.array([error(each) for each in source.equal])
                found.append((errors.mean(axis=0), errors.std(axis=0)))
                continue
            bias = error(source.mean)
            steps = [error(each) - bias for each in source.deviated]
            found.append((bias, np.linalg.norm(steps, axis=0)))
        return found

    def _currents(self, experiments: Sequence[Experiment], motion: FourierTrajectory, rate_hz: float) -> list[Array]:
        """What the first bare and the first loaded motion need, each (N, n); drives warm up in those before them."""
        at = [self._quiet.protocol.index(name) for name in PAIR]
        needed = feedforward_currents(
            [replace(each, trajectory=motion) for each in experiments[: max(at) + 1]], rate_hz
        )
        return [needed[k] for k in at]

    def _influence(self, motion: FourierTrajectory, rate_hz: float) -> tuple[Array, Array]:
        """Derivative of each joint's 1/g by its currents in the bare and the loaded motion, each (N, n)."""
        structure = self._quiet.structure
        t = np.arange(round(motion.duration * rate_hz) + 1) / rate_hz
        q, dq, ddq = motion(t)
        W = regressor(structure.arm, q, dq, ddq)
        body = next(each.plant.payload for each in self._quiet.experiments if each.loaded)
        y = W[:, :, structure.payload_columns] @ standard_parameters(body.mass, body.com, body.inertia)
        moving = np.abs(dq) > REVERSAL * np.sqrt(np.mean(dq**2, axis=0))
        bare, loaded = np.zeros(q.shape), np.zeros(q.shape)
        for j, columns in enumerate(structure.joint_independent):
            rows = moving[:, j]
            Wj, yj = W[rows, j][:, structure.base.columns[columns]], y[rows, j]
            system = np.vstack((np.column_stack((Wj, np.zeros(len(Wj)))), np.column_stack((Wj, yj))))
            scale = np.maximum(np.linalg.norm(system, axis=0), 1e-300)
            last = linalg.pinv(system / scale)[-1] / scale[-1]
            bare[rows, j], loaded[rows, j] = np.split(last, 2)
        return bare, loaded


def _source(name: str, source: DrawTable, off: Scenario, quiet: Setup) -> _Source:
    points = points_of(source, quiet.scenario.table)

    def experiments(settings: Mapping[str, Value]) -> Sequence[Experiment]:
        return setup_of(with_settings(off, settings)).experiments

    deviated, equal = (tuple(experiments(each) for each in few) for few in (points.deviated, points.equal))
    return _Source(name, experiments(points.mean), deviated, equal)
