"""Stepping one or many closed loops: the only module that touches `mujoco.batch`.

The batch is new in MuJoCo 4 and steps simulations on a thread pool, bit for bit as a loop over `mj_step` would.
`q` is a live view of the state: current after every `advance`, before which `current` may be written.
"""

from collections.abc import Sequence

import mujoco
import numpy as np
from mujoco.batch import Batch

from ident.arrays import Array


class Engine:
    """B simulations on models of one layout.

    Attributes:
        q: Joint positions [rad], a live view, shape (B, n).
        current: Current references [drive units], held until written again, shape (B, n).
    """

    def __init__(self, models: Sequence[mujoco.MjModel], start: Array, *, substeps: int, threads: int) -> None:
        """Put every simulation at rest at its start.

        Args:
            models: One compiled model a simulation; repeats are fine.
            start: Initial joint positions [rad], shape (B, n).
            substeps: Physics steps of one `advance`.
            threads: Threads to step with; results do not depend on it.
        """
        self._batch = Batch(models[0], len(models), nthread=threads)
        self._batch.set_models(list(models))
        self._substeps = substeps
        self.q: Array = self._batch.bind("qpos")
        self.current: Array = self._batch.bind("ctrl")
        self.q[:] = start

    def advance(self) -> None:
        """Step every simulation by one control period."""
        self._batch.step(nstep=self._substeps)

    def unstable(self) -> np.ndarray:
        """Simulations in which MuJoCo met a bad state and reset it, shape (B,)."""
        bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
        return self._batch.warning[:, [int(w) for w in bad], 1].any(axis=1)  # (last info, count)
