"""Stepping of one or many closed loops: the only module that uses `mujoco.batch`.

The batch is new in MuJoCo 4. It steps simulations on a thread pool with bitwise the same results as a loop over
`mj_step`.
`q` is a view of the state, updated by every `advance`; `current` may be written before each `advance`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from ident.support.arrays import Array
from sim.varying import Varied, Varying

DIVERGED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
"""Warnings of MuJoCo when it resets a bad state."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation:
    """One simulation of a batch.

    Attributes:
        model: Compiled model; its drives act on the last joints. Simulations may share it if nothing varies.
        start: Initial positions of all joints [rad], shape (nq,).
        varied: Effects that act in every control period, None if there are none.
    """

    model: mujoco.MjModel
    start: Array
    varied: Varied | None = None


class Engine:
    """B simulations on models of one layout.

    Attributes:
        q: Positions of the driven joints [rad], a live view, shape (B, n).
        current: Current references [drive units], held until written again, shape (B, n).
    """

    def __init__(self, simulations: Sequence[Simulation], *, substeps: int, threads: int) -> None:
        """Put every simulation at rest at its start.

        Args:
            simulations: Models of one layout; a simulation with varying effects has its own model.
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
        self._applied: Array = self._batch.bind("qfrc_applied")[:, -n:]
        self._rows = np.flatnonzero([s.varied is not None for s in simulations])
        members = [s.varied for s in simulations if s.varied is not None]
        self._varying: Varying | None = None
        if members:
            self._period = substeps * float(self._models[0].opt.timestep)
            self._range = np.stack([self._models[i].actuator_ctrlrange.T for i in self._rows], axis=1)
            self._varying = Varying(members, [self._models[i] for i in self._rows], period=self._period)
            self._ddq, self._rubbing = (self._batch.bind(name)[:, -n:] for name in ("qacc", "qfrc_constraint"))
        self._time = 0.0
        self._fatal = [int(w) for w in DIVERGED]

    def advance(self) -> None:
        """Step every simulation by one control period."""
        if self._varying is not None:
            rows = self._rows
            self._applied[rows] = self._varying.torque(
                t=self._time,
                q=self.q[rows],
                dq=self._dq[rows],
                v=np.clip(self.current[rows], *self._range),  # as MuJoCo does of what it is given
                ddq=self._ddq[rows],
                rubbing=self._rubbing[rows],
            )
            self._batch.set_models(self._models)  # as the batch asks for after an edit
            self._time += self._period
        self._batch.step(nstep=self._substeps)

    def roll_out(self, controls: Array) -> tuple[Array, Array]:
        """Step every simulation once for each of its controls, where nothing varies.

        A simulation with a MuJoCo warning is not stepped further, and is reported as unstable.

        Args:
            controls: Controls of every physics step, contiguous, shape (B, N, n).

        Returns:
            Positions [rad] and speeds [rad/s] of the driven joints after every step, each (B, N, n).
        """
        n = controls.shape[2]
        self._fatal = list(range(self._batch.warning.shape[1]))
        after = self._batch.rollout(controls.shape[1], controls, record=("qpos", "qvel"))
        return after["qpos"][:, :, -n:], after["qvel"][:, :, -n:]

    def warmth(self) -> Array:
        """Current temperature rise of the drives [K], shape (B, n); zero if nothing varies."""
        warmth = np.zeros_like(self.q)
        if self._varying is not None:
            warmth[self._rows] = self._varying.warmth
        return warmth

    def unstable(self) -> np.ndarray:
        """Whether each simulation had a bad state and was reset or stopped, shape (B,)."""
        return self._batch.warning[:, self._fatal, 1].any(axis=1)  # (last info, count)
