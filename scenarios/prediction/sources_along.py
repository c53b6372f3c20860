"""Errors from a scenario's sources along any motion, for the design of motions.

For every joint alone (eq. 27), at the rate of the search: the influence of each sample on 1/g times the current that a
source adds. Sources with little effect along the initial motion are omitted.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace

import numpy as np
from scipy import linalg

from ident.model.regressor import regressor
from ident.payload.payload import standard_parameters
from ident.support.arrays import Array, Indices
from scenarios.experiments.draws import settings_with, sources_of
from scenarios.experiments.scenario import setup_of, with_settings
from scenarios.experiments.schema import PAIR, Scenario
from scenarios.prediction.moments import Moments, points_of
from scenarios.support.errors import StudyError
from sim.experiment import Experiment
from sim.feedforward_currents import feedforward_currents
from sim.trajectory import FourierTrajectory

PLANT = "plant."
"""Beginning of the key paths of sources that add a current along the same motion."""
LEAST_SHARE = 0.1
"""Smallest error of a source that is included, relative to that of the largest source, on some joint to identify."""
NO_COST = 1e-9
"""Relative error of a gain due to rounding."""
REVERSAL = 0.1
"""Speed below which samples are omitted, as a share of a joint's rms speed."""


class SourcesAlong:
    """Errors from the sources of a scenario along a motion.

    Attributes:
        points: Experiments at the settings that represent each source that is included.
    """

    def __init__(self, scenario: Scenario, joints: Indices) -> None:
        """Prepare the plants. One bare and one loaded motion of the protocol are used; joints are from 0.

        Raises:
            StudyError: If the payload is not named `loaded`; if there are no sources, or none with an effect.
            ScenarioError: If a source is wrong.
        """
        off = with_settings(scenario, settings_with(sources_of(scenario), {}).settings)
        self._quiet, self._joints = setup_of(off), joints
        if not set(PAIR) <= set(self._quiet.protocol):
            raise StudyError(f"{scenario.name}: --against all needs a bare and a loaded motion in experiment.protocol")
        self.points = {
            name: points_of(source, off.table).map(lambda each: setup_of(with_settings(off, each)).experiments)
            for name, source in scenario.table.sources.items()
            if source.stream is None and all(place.startswith(PLANT) for place in source.targets)
        }
        if not self.points:
            raise StudyError(
                f"{scenario.name}: no error source changes the {PLANT[:-1]}, so a motion can be optimised against "
                "noise only; leave out --against all"
            )

    def reduced(self, motion: FourierTrajectory, rate_hz: float) -> "SourcesAlong":
        """Return a copy with only the sources that have an effect along a motion.

        Raises:
            StudyError: If there are none.
        """
        costs = {name: each.rms[self._joints].max() for name, each in self._errors(motion, rate_hz).items()}
        least = max(LEAST_SHARE * max(costs.values()), NO_COST)
        fewer = copy(self)
        fewer.points = {name: points for name, points in self.points.items() if costs[name] > least}
        if not fewer.points:
            raise StudyError(
                f"{self._quiet.scenario.name}: {', '.join(self.points)}: no effect on any gain to identify, so a "
                "motion can be optimised against noise only; leave out --against all"
            )
        return fewer

    def __call__(self, motion: FourierTrajectory, rate_hz: float) -> Array:
        """Return the root mean square relative error of every gain from all sources together, shape (n,)."""
        return Moments.together(self._errors(motion, rate_hz).values(), motion.n).rms

    def _errors(self, motion: FourierTrajectory, rate_hz: float) -> dict[str, Moments]:
        """Return the errors of every gain from each source."""
        at = [self._quiet.protocol.index(name) for name in PAIR]

        def currents(experiments: Sequence[Experiment]) -> list[Array]:
            """Return those of the first bare and loaded motions, each (N, n); earlier motions warm up drives."""
            moved = [replace(each, trajectory=motion) for each in experiments[: max(at) + 1]]
            needed = feedforward_currents(moved, rate_hz)
            return [needed[k] for k in at]

        base, influence = currents(self._quiet.experiments), self._influence(motion, rate_hz)

        def error(experiments: Sequence[Experiment]) -> Array:
            inverse = 1.0 / self._quiet.true_gain
            for K, v, before in zip(influence, currents(experiments), base, strict=True):
                inverse = inverse + np.sum(K * (v - before), axis=0)
            return 1.0 / (inverse * experiments[0].plant.drives.gain) - 1.0

        return {name: points.moments(error) for name, points in self.points.items()}

    def _influence(self, motion: FourierTrajectory, rate_hz: float) -> tuple[Array, Array]:
        """Return the derivative of each joint's 1/g with respect to its currents, bare and loaded, each (N, n)."""
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
