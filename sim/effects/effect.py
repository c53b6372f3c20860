"""What a model error is: values with ranges, and what they do to a model or to a control step.

A file of this package holds one. Its values are a dataclass whose fields are keys of a scenario's `[plant.errors]`, its
`EFFECT` the functions that act; a function that is left out does nothing. An effect whose values are zero leaves no
trace. `sim.effects` names them all.
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
    """What a model is made of, beside its errors.

    Attributes:
        robot: The arm.
        drives: Its drives as they are.
        earlier: Motions that the robot has carried out before this one in the same experiment.
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
        period: Its length [s].
        q: Positions of the driven joints [rad], shape (B, n).
        dq: Their speeds [rad/s], shape (B, n).
        v: Currents that are held over the period [drive units], shape (B, n).
        constant: Dry friction without what varies [N m], shape (B, n + c).
        speed: Speeds that it rubs at [rad/s], shape (B, n + c).
        friction: Dry friction over the period [N m], shape (B, n + c); at first `constant`, changed in place.
        damping: Viscous friction over the period [N m s/rad], shape (B, n + c); at first constant, changed in place.
        torque: Torque on the driven joints beside the drives [N m], shape (B, n); at first zero, changed in place.
        turns: Speeds that friction rubs at, as sums of joint speeds, shape (B, n + c, n).
        transmitted: Torque that the links took over from their drives [N m], shape (B, n); of the period before, and
            zero in the first.
        warmth: Temperature rise of the drives [K], shape (B, n); changed in place, and kept from period to period.
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
"""Does what an effect does in a control period."""


def _nothing(*_: object) -> None:
    """Of an effect that does nothing here."""


def _never(*_: object) -> bool:
    """Of an effect that never does."""
    return False


def _no_term(*_: object) -> Term:
    return _nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class Effect(Generic[V]):
    """What one model error does; V are its values.

    Attributes:
        fits: Refuses values that a robot or its drives have no place for, with an `EffectError`.
        resizes: Whether the values change the sizes of a model, so that it runs in a batch of its own.
        before_compile: Changes the arm as drawn, its payload and drives in place.
        after_compile: Changes the compiled model, its drives and friction injected.
        settle: Given positions of all joints with the driven ones at their start, moves the others to rest.
        varies: Whether the values act in every control period.
        term: What B simulations with these values, on these builds, get in a control period.
        instant: Whether the term follows from what a `ControlStep` holds of its moment alone, so that the moments of a
            motion can be asked for at once, as so many simulations; one that remembers is asked in order.
        along: The term of one simulation whose moments are handed over all at once, in order, for an effect that
            remembers; None where nobody has written it.
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
    """Values of B simulations by their names, each of shape (B, 1)."""
    return [np.array([[getattr(each, name)] for each in values]) for name in names]


def each_drive(builds: Sequence[Build], *names: str) -> list[Array]:
    """Numbers of the drives of B simulations by their names, each of shape (B, n)."""
    return [np.stack([np.asarray(getattr(each.drives, name), dtype=np.float64) for each in builds]) for name in names]


def tendons_ending(model: mujoco.MjModel, ending: str) -> slice:
    """Where tendons whose names end so, added one after another, stand in a compiled model; empty if there are none."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(ending)]
    return slice(found[0], found[-1] + 1) if found else slice(0)
