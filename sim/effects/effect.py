"""Definition of a model error: values with ranges, and functions that change a model or a control step.

Each file of this package defines one. Its values are a dataclass whose fields are keys of a scenario's
`[plant.errors]`; its `EFFECT` has the functions that act, and an omitted function does nothing. An effect with zero
values changes nothing. `sim.effects` lists all effects.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import mujoco
import numpy as np

from ident.support.arrays import Array
from ident.support.ranges import refuse_outside
from sim.drives import DriveTruth
from sim.errors import EffectError
from sim.robot import Robot

V = TypeVar("V", contravariant=True)


@dataclass(frozen=True, kw_only=True)
class Values:
    """Base of the values of every effect.

    Raises:
        EffectError: If a number is not finite or outside its annotated range.
    """

    def __post_init__(self) -> None:
        """Check the values."""
        refuse_outside(self, EffectError, "errors")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Build:
    """The plant of a model, without its errors.

    Attributes:
        robot: The arm.
        drives: Its true drives.
        earlier: Number of earlier motions of the robot in the same experiment.
        step: Physics step [s].
    """

    robot: Robot
    drives: DriveTruth
    earlier: int
    step: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlStep:
    """The start of a control period of B simulations with n joints and c coupled motors.

    Attributes:
        t: Time since the start of the motion [s].
        period: Control period [s].
        q: Positions of the driven joints [rad], shape (B, n).
        dq: Their speeds [rad/s], shape (B, n).
        v: Currents that are held over the period [drive units], shape (B, n).
        constant: Constant part of dry friction [N m], shape (B, n + c).
        speed: Speeds at which friction acts [rad/s], shape (B, n + c).
        friction: Dry friction over the period [N m], shape (B, n + c); at first `constant`, changed in place.
        damping: Viscous friction over the period [N m s/rad], shape (B, n + c); at first constant, changed in place.
        torque: Additional torque on the driven joints [N m], shape (B, n); at first zero, changed in place.
        turns: Matrix from joint speeds to the speeds at which friction acts, shape (B, n + c, n).
        transmitted: Torque transmitted from drives to links [N m], shape (B, n); of the preceding period, zero in the
            first.
        warmth: Temperature rise of the drives [K], shape (B, n); changed in place and kept between periods.
    """

    t: float
    period: float
    q: Array
    dq: Array
    v: Array
    constant: Array
    speed: Array
    friction: Array
    damping: Array
    torque: Array
    turns: Array
    transmitted: Array
    warmth: Array


Term = Callable[[ControlStep], None]
"""Function of an effect in a control period."""


def _nothing(*_: object) -> None:
    """Function of an effect that does nothing at this point."""


def _never(*_: object) -> bool:
    """Function of an effect that never varies."""
    return False


def _no_term(*_: object) -> Term:
    return _nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class Effect(Generic[V]):
    """Functions of one model error; V is the type of its values.

    Attributes:
        fits: Raises an `EffectError` for values that do not apply to a robot or its drives.
        resizes: Whether the values change the sizes of a model, so that it runs in a batch of its own.
        before_compile: Changes the model specification of arm, payload and drives in place.
        after_compile: Changes the compiled model, which has its drives and friction.
        settle: Moves the joints that are not driven to equilibrium, with the driven ones at their start.
        varies: Whether the values act in every control period.
        term: Returns the function that acts in a control period on B simulations with these values and builds.
        instant: Whether the term depends only on the current `ControlStep`, so that all steps of a motion can be
            evaluated together, as separate simulations. A term with memory is evaluated in order.
        along: For a term with memory: the term of one simulation that receives all its steps together, in order; None
            if not implemented.
    """

    fits: Callable[[V, Robot, DriveTruth], None] = _nothing
    resizes: Callable[[V], bool] = _never
    before_compile: Callable[[V, mujoco.MjSpec, Build], None] = _nothing
    after_compile: Callable[[V, mujoco.MjModel, Build], None] = _nothing
    settle: Callable[[V, mujoco.MjModel, Array], None] = _nothing
    varies: Callable[[V], bool] = _never
    term: Callable[[Sequence[V], Sequence[Build]], Term] = _no_term
    instant: bool = False
    along: Callable[[V, Build], Term] | None = None


def each_value(values: Sequence[object], *names: str) -> list[Array]:
    """Return values of B simulations by name, each of shape (B, 1)."""
    return [np.array([[getattr(each, name)] for each in values]) for name in names]


def each_drive(builds: Sequence[Build], *names: str) -> list[Array]:
    """Return parameters of the drives of B simulations by name, each of shape (B, n)."""
    return [np.stack([np.asarray(getattr(each.drives, name), dtype=np.float64) for each in builds]) for name in names]


def tendons_ending(model: mujoco.MjModel, ending: str) -> slice:
    """Return the slice of tendons of a compiled model whose names have this ending; empty if there are none."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(ending)]
    return slice(found[0], found[-1] + 1) if found else slice(0)
