"""A plant effect of one's own, from outside: hoses that pull the first joint back, `tau_1 = -k q_1`.

What do they cost? Each joint's gain with the hoses and without, from the same motions and the same noise.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

import ident
import scenarios
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, Effect


@dataclass(frozen=True, kw_only=True)
class DressPack(Effect):
    """Hoses along the arm.

    Attributes:
        dress_pack: Stiffness of the hoses about the first joint [N m/rad].
    """

    dress_pack: float = 0.0

    def before_compile(self, spec: mujoco.MjSpec, build: Build) -> None:
        """Put the spring on the first joint."""
        spec.joints[0].stiffness[0] = getattr(self, "dress_pack", 0.0)  # plants without hoses have no such value


@dataclass(frozen=True, kw_only=True)
class Errors(DressPack, ModelErrors):
    """All model errors there are, and one more."""


EFFECTS["DressPack"] = DressPack
exp = scenarios.load("nominal")


def gains(stiffness: float) -> np.ma.MaskedArray:
    """The gains found with hoses of that stiffness, masked where refused."""
    errors = Errors(dress_pack=stiffness)
    motions = [replace(each, plant=replace(each.plant, errors=errors)) for each in exp.setup.experiments]
    logs = replace(exp, setup=replace(exp.setup, experiments=tuple(motions))).simulate(seed=0).logs
    return ident.identify(exp.arm, logs, method="ls-2011").gain


for joint, change in enumerate(100.0 * (gains(30.0) / gains(0.0) - 1.0), 1):
    print(f"joint {joint}: refused" if change is np.ma.masked else f"joint {joint}: {change:+.2f} %")
