"""Stepping of one or many closed loops, with effects that act in every control period.

This is the only module that uses `mujoco.batch`, which is new in MuJoCo 4. It steps simulations on a thread pool with
bitwise the same results as a loop over `mj_step`.

MuJoCo's dry and viscous friction are constants of the model. If they vary in time, they are computed from state and
currents at the start of the control period, written into the model of that simulation, and held over the period.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from ident.support.arrays import Array
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, ControlStep, drives_of
from sim.effects.transmissions import places_of_motors
from sim.model_spec import driven_joints
from sim.plant import Plant

DIVERGED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
"""Warnings of MuJoCo when it resets a bad state."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Varied:
    """A simulation with effects that act in every control period."""

    errors: ModelErrors
    build: Build
    constant: Array  # dry friction without these effects: joints, then coupled motors [N m], shape (n + c,)
    damping: Array  # viscous friction without these effects [N m s/rad], shape (n + c,)
    inertia: Array  # rotor inertias [kg m^2], shape (n + c,)
    turns: Array  # matrix from joint speeds to the speeds at which friction acts, shape (n + c, n)
    warmth: Array  # temperature rise of the drives at the start of the motion [K], shape (n,)


def varies(errors: ModelErrors) -> bool:
    """Return whether any effect acts in every control period."""
    return any(effect.varies(errors) for effect in EFFECTS.values())


def acting(plant: Plant, model: mujoco.MjModel, *, step: float, earlier: int, warmth: Array | None = None) -> Varied:
    """Return the effects in a control period of a compiled plant; `warmth` is that of the drives [K], (n,)."""
    n, places = plant.robot.n, places_of_motors(model)
    constant, damping, inertia = (
        np.concatenate([getattr(model, f"{kind}_{name}")[place] for kind, place in places])
        for name in ("frictionloss", "damping", "armature")
    )
    turns = np.eye(len(constant), n)
    for row, coupling in zip(turns[n:], plant.robot.coupling, strict=False):  # no coupled motors, no rows
        row[[coupling.motor, coupling.turns_with]] = 1.0
    return Varied(
        errors=plant.errors,
        build=Build(robot=plant.robot, drives=plant.drives, earlier=earlier, step=step),
        constant=constant,
        damping=damping,
        inertia=inertia,
        turns=turns,
        warmth=np.zeros(n) if warmth is None else warmth,
    )


class Varying:
    """The effects of several simulations of one layout, as one function of their states."""

    def __init__(self, members: Sequence[Varied], models: Sequence[mujoco.MjModel], *, period: float) -> None:
        """Stack the constant arrays of simulations with these models and this control period [s]."""
        errors, builds = [m.errors for m in members], [m.build for m in members]
        active = [effect for effect in EFFECTS.values() if any(effect.varies(each) for each in errors)]
        self._terms = [effect.term(errors, builds) for effect in active]
        self._constant, self._damping, self._inertia, self._turns, self.warmth = (
            np.stack([getattr(m, name) for m in members])
            for name in ("constant", "damping", "inertia", "turns", "warmth")
        )
        self._drives = drives_of(builds)
        self._period = period
        self._written = [  # views of dry and viscous friction of each model, of n motors, then of c coupled ones
            [
                [getattr(model, f"{kind}_{name}")[place] for kind, place in places_of_motors(model)]
                for name in ("frictionloss", "damping")
            ]
            for model in models
        ]
        self._before: ControlStep | None = None

    def torque(self, *, q: Array, dq: Array, v: Array, ddq: Array, rubbing: Array) -> Array:
        """Write the friction of a control period, and return the additional torque [N m], shape (B, n).

        The arguments are those of `ControlStep`; accelerations and torques of dry friction (rubbing) are of the last
        physics step.
        """
        step = ControlStep(
            period=self._period,
            q=q,
            dq=dq,
            v=v,
            speed=(self._turns @ dq[:, :, None])[:, :, 0],
            friction=self._constant.copy(),
            damping=self._damping.copy(),
            torque=np.zeros_like(dq),
            turns=self._turns,
            transmitted=self._transmitted(ddq, rubbing),
            warmth=self.warmth,
        )
        for add in self._terms:
            add(step)
        self._before = step
        for fields, dry, viscous in zip(self._written, step.friction, step.damping, strict=True):
            for (motors, *coupled), row in zip(fields, (dry, viscous), strict=True):
                motors[:] = row[: len(motors)]
                for each in coupled:
                    each[:] = row[len(motors) :]
        return step.torque

    def _transmitted(self, ddq: Array, rubbing: Array) -> Array:
        """Return the torque transmitted to the links in the preceding period, without inertial torque of the rotors."""
        before = self._before
        if before is None:
            return np.zeros_like(ddq)
        own = self._drives
        spun = self._inertia * (self._turns @ ddq[:, :, None])[:, :, 0] + before.damping * before.speed
        motors = own["gain"] * (before.v - own["amplifier_offset"]) - own["coulomb_asymmetry"] + before.torque + rubbing
        return motors - (self._turns.transpose(0, 2, 1) @ spun[:, :, None])[:, :, 0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation:
    """One simulation of a batch."""

    model: mujoco.MjModel  # compiled model. Simulations may share it if nothing varies
    start: Array  # initial positions of all joints [rad], shape (nq,)
    motors: Array | None = None  # matrix from positions of joints to those of motors, (n, n); None if they are the same
    varied: Varied | None = None  # effects that act in every control period, None if there are none


class Engine:
    """B simulations on models of one layout."""

    def __init__(self, simulations: Sequence[Simulation], *, substeps: int, threads: int) -> None:
        """Put every simulation at rest at its start; an `advance` has `substeps` physics steps."""
        self._models = [s.model for s in simulations]
        self._batch = Batch(self._models[0], len(self._models), nthread=threads)
        self._batch.set_models(self._models)
        self._substeps = substeps
        own = driven_joints(self._models[0])
        state: Array = self._batch.bind("qpos")
        state[:] = [s.start for s in simulations]
        self.q: Array = state[:, own]  # positions of the driven joints [rad], a live view, (B, n)
        turned = [s.motors for s in simulations if s.motors is not None]  # of all, as their layout is the same
        self._motors = np.stack(turned) if turned else None
        self.current: Array = self._batch.bind("ctrl")  # references, held until written again, (B, n)
        self._dq: Array = self._batch.bind("qvel")[:, own]
        self._applied: Array = self._batch.bind("qfrc_applied")[:, own]
        self._rows = np.flatnonzero([s.varied is not None for s in simulations])
        members = [s.varied for s in simulations if s.varied is not None]
        self._varying: Varying | None = None
        if members:
            self._range = np.stack([self._models[i].actuator_ctrlrange.T for i in self._rows], axis=1)
            self._varying = Varying(
                members, [self._models[i] for i in self._rows], period=substeps * float(self._models[0].opt.timestep)
            )
            self._ddq, self._rubbing = (self._batch.bind(name)[:, own] for name in ("qacc", "qfrc_constraint"))

    def read(self, out: Array) -> None:
        """Write the positions of the motors [rad], shape (B, n)."""
        if self._motors is None:
            out[...] = self.q
        else:
            np.einsum("bij,bj->bi", self._motors, self.q, out=out)

    def advance(self) -> None:
        """Step every simulation by one control period."""
        if self._varying is not None:
            rows = self._rows
            q, dq, ddq, rubbing = (each[rows] for each in (self.q, self._dq, self._ddq, self._rubbing))
            if self._motors is not None:
                A = self._motors[rows]
                q, dq, ddq = (np.einsum("bij,bj->bi", A, each) for each in (q, dq, ddq))
                rubbing = np.asarray(np.linalg.solve(A.swapaxes(1, 2), rubbing[:, :, None])[:, :, 0], np.float64)
            v = np.clip(self.current[rows], *self._range)  # as MuJoCo does of what it is given
            torque = self._varying.torque(q=q, dq=dq, v=v, ddq=ddq, rubbing=rubbing)
            if self._motors is not None:  # on the joints, A' that of the motors
                torque = np.einsum("bij,bi->bj", self._motors[rows], torque)
            self._applied[rows] = torque
            self._batch.set_models(self._models)  # as the batch asks for after an edit
        self._batch.step(nstep=self._substeps)

    def warmth(self) -> Array:
        """Current temperature rise of the drives [K], shape (B, n); zero if nothing varies."""
        warmth = np.zeros_like(self.q)
        if self._varying is not None:
            warmth[self._rows] = self._varying.warmth
        return warmth

    def unstable(self) -> np.ndarray:
        """Whether each simulation had a bad state and was reset or stopped, shape (B,)."""
        return self._batch.warning[:, [int(w) for w in DIVERGED], 1].any(axis=1)  # (last info, count)
