"""Stepping one or many closed loops: the only module that touches `mujoco.batch`.

The batch is new in MuJoCo 4 and steps simulations on a thread pool, bit for bit as a loop over `mj_step` would.
`q` is a live view of the state: current after every `advance`, before which `current` may be written.

MuJoCo's dry friction is a constant of the model. Where it varies in time, `advance` writes it into that simulation's
model from speeds and currents at the start of the control period, and it is held over the period.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from mujoco.batch import Batch

from ident.arrays import Array
from sim.friction import FrictionLaw, dry_friction
from sim.mechanisms import coupling_tendons


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation:
    """One simulation of a batch.

    Attributes:
        model: Compiled model; its drives act on the last joints. It may serve many simulations if friction is constant.
        start: Initial positions of all joints [rad], shape (nq,).
        friction: How dry friction varies, None if it does not.
    """

    model: mujoco.MjModel
    start: Array
    friction: FrictionLaw | None = None


class Engine:
    """B simulations on models of one layout.

    Attributes:
        q: Positions of the driven joints [rad], a live view, shape (B, n).
        current: Current references [drive units], held until written again, shape (B, n).
    """

    def __init__(self, simulations: Sequence[Simulation], *, substeps: int, threads: int) -> None:
        """Put every simulation at rest at its start.

        Args:
            simulations: Models of one layout; each with varying friction has a model of its own.
            substeps: Physics steps of one `advance`.
            threads: Threads to step with; results do not depend on it.
        """
        self._models = [s.model for s in simulations]
        self._batch = Batch(self._models[0], len(self._models), nthread=threads)
        self._batch.set_models(self._models)
        self._substeps = substeps
        n = self._models[0].nu
        state: Array = self._batch.bind("qpos")
        state[:] = [s.start for s in simulations]
        self.q: Array = state[:, -n:]
        self.current: Array = self._batch.bind("ctrl")
        self._dq: Array = self._batch.bind("qvel")[:, -n:]
        self._varying = np.flatnonzero([s.friction is not None for s in simulations])
        self._law = _stacked([s.friction for s in simulations if s.friction is not None])
        self._written = [_friction_fields(self._models[i]) for i in self._varying]

    def advance(self) -> None:
        """Step every simulation by one control period."""
        if self._law is not None:
            rows = dry_friction(self._law, self._dq[self._varying], self.current[self._varying])
            for (joints, couplings), row in zip(self._written, rows, strict=True):
                joints[:], couplings[:] = row[: len(joints)], row[len(joints) :]
            self._batch.set_models(self._models)  # as the batch asks for after an edit
        self._batch.step(nstep=self._substeps)

    def unstable(self) -> np.ndarray:
        """Simulations in which MuJoCo met a bad state and reset it, shape (B,)."""
        bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
        return self._batch.warning[:, [int(w) for w in bad], 1].any(axis=1)  # (last info, count)


def _stacked(laws: Sequence[FrictionLaw]) -> FrictionLaw | None:
    """The laws of several simulations as one with a leading axis."""
    if not laws:
        return None
    return FrictionLaw(**{f.name: np.stack([getattr(law, f.name) for law in laws]) for f in fields(FrictionLaw)})


def _friction_fields(model: mujoco.MjModel) -> tuple[Array, Array]:
    """Live views of a model's dry friction: driven joints (n,), and coupled motors (c,)."""
    return model.dof_frictionloss[-model.nu :], model.tendon_frictionloss[coupling_tendons(model)]
