"""The errors that a scenario's sources make along any motion: what a motion is designed against besides noise.

Of every joint alone (eq. 27), at the rate of the search: the influence of each sample on 1/g, times the current that a
source adds. Sources that cost little along the motion at hand are left out of the search.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from scipy import linalg

from ident.model.regressor import regressor
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array, Indices
from scenarios.experiments.build import setup_of
from scenarios.experiments.files.mountings import PAIR
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.files.settings import with_settings
from scenarios.experiments.studies.sources import settings_with, sources_of
from scenarios.prediction.moments import Moments, Settings, points_of
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


class SourcesAlong:
    """The errors that the sources of a scenario make along a motion."""

    def __init__(self, scenario: Scenario, joints: Indices) -> None:
        """Prepare the plants. Of the scenario's protocol one bare and one loaded motion count; joints are from 0.

        Raises:
            StudyError: If the payload is called otherwise than `loaded`; if there are none, or none that counts.
            ScenarioError: If a source is wrong.
        """
        off = with_settings(scenario, settings_with(sources_of(scenario), {}).settings)
        quiet = setup_of(off)
        if not set(PAIR) <= set(quiet.protocol):
            raise StudyError(f"{scenario.name}: --against all needs a bare and a loaded motion in experiment.protocol")
        self._quiet, self._joints = quiet, joints

        def experiments(settings: Settings) -> Sequence[Experiment]:
            return setup_of(with_settings(off, settings)).experiments

        self._points = {
            name: points_of(source, quiet.scenario.table).map(experiments)
            for name, source in scenario.table.sources.items()
            if source.stream is None and all(place.startswith(PLANT) for place in source.targets)
        }
        if not self._points:
            raise StudyError(
                f"{scenario.name}: no error source changes the {PLANT[:-1]}, so a motion can be optimised against "
                "noise only; leave out --against all"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Sources that count."""
        return tuple(self._points)

    def reduced(self, motion: FourierTrajectory, rate_hz: float) -> "SourcesAlong":
        """The same with the sources alone that cost something along a motion.

        Raises:
            StudyError: If none does.
        """
        costs = {name: each.rms[self._joints].max() for name, each in self._errors(motion, rate_hz).items()}
        least = max(LEAST_SHARE * max(costs.values()), NO_COST)
        fewer = copy(self)
        fewer._points = {name: points for name, points in self._points.items() if costs[name] > least}
        if not fewer._points:
            raise StudyError(
                f"{self._quiet.scenario.name}: {', '.join(self.names)}: no effect on any gain to identify, so a "
                "motion can be optimised against noise only; leave out --against all"
            )
        return fewer

    def __call__(self, motion: FourierTrajectory, rate_hz: float) -> Array:
        """Root mean square relative error of every gain, all sources together, shape (n,)."""
        errors = self._errors(motion, rate_hz).values()
        bias = np.sum([each.bias for each in errors], axis=0)
        return np.sqrt(bias**2 + np.sum([each.std**2 for each in errors], axis=0))

    def _errors(self, motion: FourierTrajectory, rate_hz: float) -> dict[str, Moments]:
        """What each source costs every gain."""
        base = self._currents(self._quiet.experiments, motion, rate_hz)
        influence = self._influence(motion, rate_hz)

        def error(experiments: Sequence[Experiment]) -> Array:
            inverse = 1.0 / self._quiet.true_gain
            for K, v, before in zip(influence, self._currents(experiments, motion, rate_hz), base, strict=True):
                inverse = inverse + np.sum(K * (v - before), axis=0)
            return 1.0 / (inverse * experiments[0].plant.drives.gain) - 1.0

        return {name: points.moments(error) for name, points in self._points.items()}

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
