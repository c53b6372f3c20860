"""A problem of three joints in which something is believed of friction, gains and a shared column, and its fit."""

from dataclasses import dataclass, replace

import numpy as np
from exact import exact_problem

from ident.estimation.all_joints import Fit, search
from ident.estimation.setting import Model, Setting, Term, setting
from ident.model.structure import Structure
from ident.payload.payload import Payload

N = 3
TRUE = np.array([0.93, -4.1, 0.37])


@dataclass(frozen=True)
class Case:
    """A problem of three joints with a further column of friction that something is believed of, and of log|h|."""

    ready: Setting
    term: Term
    mean: np.ndarray
    std: np.ndarray

    @property
    def model(self) -> Model:
        return Model.of(self.ready, {"cbrt": self.term})

    def fit(self, start: np.ndarray = 1.0 / TRUE) -> Fit:
        model, found = search(self.model, start, self.mean, self.std)
        return Fit(
            ready=self.ready, model=model, h=found.h, z=found.z, mean=self.mean, log_std=self.std, cost=found.cost
        )


BELIEVED_STD = 7e-4
"""Deviation of the coefficient of a shared column, about that which data leave."""


def case(small: Structure, unsure: Payload, noise: float, *, pull: float = 1.0) -> Case:
    """Beliefs that are off by some 15 and 30 deviations, times `pull`; one shared column is believed to be small."""
    rng = np.random.default_rng(11)
    chi = rng.uniform(0.5, 2.0, 14 * N)
    motions = [(chi, None, None), (chi, unsure, unsure), (chi, unsure, replace(unsure, known="mass"))]
    ready = setting(exact_problem(small, motions, TRUE, rng, noise=noise, rows=60), per_motion=True, prior_std=1.0)
    return Case(
        ready=ready.widened(rng.normal(size=(len(ready.columns.V), 1)), BELIEVED_STD),
        term=Term(np.cbrt(ready.columns.own("Fv")), mean=0.3 * pull, std=0.02),
        mean=np.log((1.0 + 0.07 * pull) / np.abs(TRUE)),
        std=np.array([0.03, 0.4, 0.002]),
    )
