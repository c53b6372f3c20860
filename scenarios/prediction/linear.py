"""An estimate from expected logs, linearised: what a change of any logged current does to each gain.

The change of 1/g_j is the sum over rows of their influence times the change of each row's current, which is cleared of
reversals and decimated as the current was.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import estimator
from ident.numerics.signals import delayed
from ident.observation.full_rate import FullRate
from ident.preparation import Prepared
from ident.support.arrays import Array
from scenarios.experiments.build import Setup
from scenarios.experiments.files.mountings import grouped
from scenarios.prediction.expected import expected_preparation
from scenarios.support.errors import StudyError

NOT_LINEAR = ("ols", "tls-2014")
"""Methods in which noise of the currents stands in the matrix: their errors are of second order."""


@dataclass(frozen=True, slots=True, eq=False)
class Linearised:
    """An estimate and how it moves.

    Attributes:
        setup: What it was made from.
        expected: Its logs.
        estimate: Its k solved gains come with the influence of each row.
        behind: The motion behind the rows, motions in order of time.
        places: Place of each motion of the estimate in order of time.
        every: Samples of the controller to one of the expected logs.
    """

    setup: Setup
    expected: Prepared
    estimate: GainEstimate
    behind: tuple[FullRate, ...]
    places: tuple[int, ...]
    every: int

    def change(self, added: Sequence[Array]) -> Array:
        """Change of each 1/g, shape (k,).

        Args:
            added: Change of the logged currents of each motion in order of time [drive units], each (N, n).
        """
        solution, later = self.estimate.solution, self._later
        dV = np.zeros(len(solution.rows.V))
        for number, place in enumerate(self.places):
            behind, v = self.behind[place], delayed(added[place], later)
            signal = behind.sampled(v)
            for joint in range(v.shape[1]):
                of = (solution.rows.joint == joint) & (solution.rows.motion == number)
                dV[of] = behind.decimated(signal[:, joint], joint)[solution.rows.position[of]]
        return solution.influence @ dV

    def weights(self, samples: int) -> list[Array]:
        """Derivative of each 1/g by each sample of each motion in order of time, each (k, samples, n).

        A delay that identification gives the currents is left out: noise does not care.

        Args:
            samples: Of each recording.
        """
        solution, n = self.estimate.solution, self.setup.structure.arm.n
        found = [np.zeros((len(solution.joints), samples, n)) for _ in self.behind]
        for number, place in enumerate(self.places):
            behind = self.behind[place]
            for joint in range(n):
                of = (solution.rows.joint == joint) & (solution.rows.motion == number)
                at, share = solution.rows.position[of], solution.influence[:, of]
                for k in np.flatnonzero(share.any(axis=1)):
                    rows = np.zeros(int(at[-1]) + 1)
                    rows[at] = share[k]
                    found[place][k, :, joint] = behind.spread(rows, joint, samples)
        return found

    @property
    def _later(self) -> float:
        table = self.setup.scenario.table
        return table.identification.observe.current_delay * table.experiment.controller.rate_hz / self.every


def linearised(setup: Setup, every: int) -> Linearised:
    """Estimate the gains of a prepared scenario from its expected logs.

    Args:
        setup: The scenario, nothing random left.
        every: Samples of the controller to one of the expected logs.

    Raises:
        StudyError: If the scenario's method has no first order.
        IdentificationError: If there is nothing to identify.
        PlantError: If a plant cannot be built.
    """
    chosen = setup.scenario.table.identification
    if chosen.method in NOT_LINEAR:
        raise StudyError(
            f"{setup.scenario.name}: method {chosen.method}: its second-order bias from noise is not "
            "predicted; simulate it with rx90 sensitivity, or choose another --method"
        )
    expected = expected_preparation(setup, every)
    places = grouped(setup.protocol)
    in_time = sorted(zip(places, expected.parts, strict=True), key=lambda pair: pair[0])
    return Linearised(
        setup=setup,
        expected=expected,
        estimate=estimator(chosen.method).estimate(expected.problem, chosen.method_options),
        behind=tuple(behind for _, part in in_time if (behind := part.observation.full_rate) is not None),
        places=places,
        every=every,
    )
