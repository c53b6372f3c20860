"""Definition of a model error: values, and functions that change a model or a control step.

An effect is a dataclass. Its fields are keys of a scenario's `[plant.errors]`, zero for no effect; its methods act on
the plant, and an inherited method does nothing. `sim.effects` lists all effects. The values of all effects are one
object there, `ModelErrors`, and each method is called on it as that of its own class (`Stribeck.varies(errors)`). A
method may read any value, but calls functions and not methods.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, ClassVar

import mujoco
import numpy as np
from annotated_types import Interval

from ident.support.arrays import Array
from ident.support.options import refuse_outside
from sim.errors import PlantError
from sim.robot import DriveTruth, Robot


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Build:
    """The plant of a model, without its errors."""

    robot: Robot
    drives: DriveTruth
    earlier: int  # number of earlier motions of the robot in the same experiment
    step: float  # physics step [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControlStep:
    """The start of a control period of B simulations with n joints and c coupled motors."""

    period: float  # control period [s]
    q: Array  # positions of the driven joints [rad], shape (B, n)
    dq: Array  # their speeds [rad/s], shape (B, n)
    v: Array  # currents, held over the period [drive units], shape (B, n)
    speed: Array  # speeds at which friction acts [rad/s], shape (B, n + c)
    friction: Array  # dry friction [N m], (B, n + c); at first constant, changed in place
    damping: Array  # viscous friction [N m s/rad], (B, n + c); at first constant, changed in place
    torque: Array  # additional torque on the driven joints [N m], (B, n); at first zero, changed in place
    turns: Array  # matrix from joint speeds to those, shape (B, n + c, n)
    transmitted: Array  # torque from drives to links in the period before [N m], (B, n); at first zero
    warmth: Array  # temperature rise of the drives [K], (B, n); changed in place, kept between periods


Share = Annotated[float, Interval(ge=0.0, le=1.0)]
"""A value that is a share of something."""
Term = Callable[[ControlStep], None]
"""Function of an effect in a control period."""
Stacked = Mapping[str, Array]
"""Numbers of B simulations by name."""


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base of the effects.

    Attributes:
        instant: Whether the term depends only on the current `ControlStep`, so that all steps of a motion can be
            evaluated together, as separate simulations. A term with memory is evaluated in order.
        adds: Whether it adds bodies or tendons to a model, which then runs in a batch of its own.
    """

    instant: ClassVar[bool] = True
    adds: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Check the ranges."""
        refuse_outside(self, PlantError, "errors")

    def fits(self, robot: Robot, drives: DriveTruth) -> None:
        """Raise a `PlantError` for values that do not apply to a robot or its drives."""

    @classmethod
    def acts(cls, values: object) -> bool:
        """Return whether one of its values that are zero by default is not."""
        return any(getattr(values, each.name) for each in fields(cls) if not each.default)

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        """Change the model specification of arm, payload and drives in place."""

    def after_compile(self, model: mujoco.MjModel, build: Build) -> None:
        """Change the compiled model, which has its drives and friction."""

    def settle(self, model: mujoco.MjModel, state: Array) -> None:
        """Move links to their motors, or to one side of a gap; springs then yield until they are in equilibrium."""

    @classmethod
    def varies(cls, values: object) -> bool:
        """Return whether the values act in every control period."""
        return (cls.act is not Effect.act or cls.term.__func__ is not Effect.term.__func__) and cls.acts(values)

    @classmethod
    def term(cls, values: Sequence[object], builds: Sequence[Build]) -> Term:
        """Return the function that acts in a control period on B simulations; an effect with a memory has its own."""
        names = [each.name for each in fields(cls)]
        return partial(cls.act, dict(zip(names, each_value(values, *names), strict=True)), drives_of(builds))

    @staticmethod
    def act(values: Stacked, drives: Stacked, step: ControlStep) -> None:
        """Change a control step, with values of shape (B, 1) and parameters of the drives, (B, n), by their names."""
        raise NotImplementedError("an effect that varies needs `act`, or a `term` of its own")

    def along(self, build: Build) -> Term | None:
        """Return the term of one simulation that receives all its steps together, in order; None if there is none."""
        return None


def each_value(values: Sequence[object], *names: str) -> list[Array]:
    """Return values of B simulations by name, each of shape (B, 1)."""
    return [np.array([[getattr(each, name)] for each in values]) for name in names]


def drives_of(builds: Sequence[Build]) -> dict[str, Array]:
    """Return the parameters of the drives of B simulations by name, each of shape (B, n).

    Beside them are the number of `earlier` motions, (B, 1), and the `motor` of each friction, from 0, (B, n + c).
    """
    names = [each.name for each in fields(DriveTruth)]
    found = {name: np.stack([np.asarray(getattr(each.drives, name), np.float64) for each in builds]) for name in names}
    motor = [[*range(each.robot.n), *(pair.motor for pair in each.robot.coupling)] for each in builds]
    return {**found, "earlier": np.array([[each.earlier] for each in builds]), "motor": np.array(motor)}
