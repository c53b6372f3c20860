"""A plant effect of one's own, from outside: hoses that pull the first joint back, `tau_1 = -k q_1`.

What do they cost? Each joint's gain with the hoses and without, from the same motions and the same noise.
"""

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ident.identification import identify_motions
from scenarios import load_scenario
from scenarios.experiments.build import bench
from scenarios.experiments.run import as_identified
from sim.effects import EFFECTS, ModelErrors
from sim.effects.effect import Build, Effect
from sim.record import record
from sim.sensors import noise_streams


@dataclass(frozen=True, kw_only=True)
class Errors(ModelErrors):
    """All model errors there are, and one more.

    Attributes:
        dress_pack: Stiffness of the hoses about the first joint [N m/rad].
    """

    dress_pack: float = 0.0


def tie(values: ModelErrors, spec: mujoco.MjSpec, build: Build) -> None:
    """Put the spring on the first joint."""
    if isinstance(values, Errors) and values.dress_pack:
        spec.joints[0].stiffness[0] = values.dress_pack


EFFECTS["dress_pack"] = Effect[ModelErrors](before_compile=tie)
cell = bench(load_scenario("nominal"))


def gains(stiffness: float) -> list[float]:
    """The gains found with hoses of that stiffness."""
    experiments = [
        replace(each, plant=replace(each.plant, errors=Errors(dress_pack=stiffness))) for each in cell.experiments
    ]
    streams = [noise_streams(np.random.default_rng(seed)) for seed in range(len(experiments))]
    motions = as_identified(cell, record(experiments, streams, threads=1))
    found = identify_motions(motions, cell.structure, method="ls-2011")
    return [getattr(joint, "value", np.nan) for joint in found.estimate.joints]


without, with_hoses = np.array(gains(0.0)), np.array(gains(30.0))
for joint, change in enumerate(100.0 * (with_hoses / without - 1.0), 1):
    print(f"joint {joint}: {change:+.2f} %" if np.isfinite(change) else f"joint {joint}: refused")
