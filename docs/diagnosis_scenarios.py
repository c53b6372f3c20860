"""Sound but hostile conditions of robots that MuJoCo simulates: scenarios laid over built-in ones."""

import json
import tempfile
import tomllib
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from simulations import outcomes_of

from ident.model.structure import Structure
from ident.recordings.motion import Motion
from ident.support.arrays import Array
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.motions import MOTIONS
from scenarios.experiments.robots import robot_of
from scenarios.experiments.run import Simulated

VERSION = 2
"""Of this file, one more where logs change."""
ROBOTS = {"rx90": "nominal", "ur10e": "ur10e", "panda": "panda", "tx40": "tx40", "stanford": "stanford"}
"""Scenario of each robot."""
APART = ("stanford",)
BIASED = ("soft joints 8 Hz", "soft joints 12 Hz", "backlash 3 mrad", "presliding 5 mrad")
"""Fault-free logs whose gains presently have significant errors."""
RX90_ONLY = ("field", "paper-noise", "coarse-encoder", "drift", "mass-only", "offset-payload", "fleet")
"""Built-in scenarios of one robot."""
SOFT = (8.0, 12.0, 20.0, 25.0)
"""Natural frequencies of rotors on their transmissions [Hz]: `%(soft8)s` is the compliance of each joint."""
ELASTIC = "[plant.errors]\njoint_compliance = %%(soft%g)s\n"
CONDITIONS: dict[str, str] = {
    "backlash 0.5 mrad": ELASTIC % 25.0 + "backlash = 5e-4",
    "backlash 3 mrad": ELASTIC % 20.0 + "backlash = 3e-3",
    "soft joints 8 Hz": ELASTIC % 8.0,
    "soft joints 12 Hz": ELASTIC % 12.0,
    "soft joints 20 Hz": ELASTIC % 20.0,
    "presliding 2 mrad": "[plant.errors]\npresliding = 0.002",
    "presliding 5 mrad": "[plant.errors]\npresliding = 0.005",
    "stribeck": "[plant.errors]\nstribeck = 0.4\nstribeck_speed = 0.15",
    "viscous curve": "[plant.errors]\nviscous_curve = 0.4",
    "drift 5 %%": "[plant.errors]\ncoulomb_drift = 0.05\nviscous_drift = -0.05",
    "drift 20 %%": "[plant.errors]\ncoulomb_drift = -0.2\nviscous_drift = -0.2",
    "load friction 5 %%": "[plant.errors]\nload_friction = 0.05",
    "load friction 15 %%": "[plant.errors]\nload_friction = 0.15",
    "transmitted friction 10 %%": "[plant.errors]\ntransmitted_friction = 0.1",
    "by direction": "[plant.errors]\ncoulomb_by_direction = 0.3\nviscous_by_direction = -0.1",
    "cogging": "[plant.errors]\ncogging = 0.01\ntorque_ripple = 0.01\nmotor_waves = 400.0",
    "base tilt 2 mrad": "[plant.errors]\nbase_tilt_x = 0.002\nbase_tilt_y = -0.0015",
    "temperature": "[plant.errors]\nmotor_warming = 60.0\nwarming_time = 300.0\ngain_by_temperature = -0.0005\n"
    "coulomb_by_temperature = -0.006\nviscous_by_temperature = -0.01",
    "current noise 10 %%": "[experiment.sensors]\ncurrent_white = 0.1\ncurrent_coloured = 0.08",
    "current noise below 5 Hz": "[experiment.sensors]\ncurrent_white = 0.03\n"
    "current_coloured = 0.05\ncoloured_cutoff_hz = 5.0",
    "clock jitter": "[experiment.sensors]\nclock_jitter = 1e-4",
    "encoder 0.1 mrad": "[experiment.sensors]\nencoder_quantum = 1e-4\nencoder_noise = 5e-5",
    "soft controller": "[experiment.controller]\nbandwidth_hz = 2.0\n[experiment.sensors]\nencoder_quantum = 1e-3",
    "slow": '[experiment]\nmotion = "slow.toml"',
    "short": '[experiment]\nmotion = "short.toml"',
    "backwards": '[experiment]\nmotion = "backwards.toml"',
    "mass only": '[belief]\nknown = "mass"',
    "three logs": '[experiment]\nprotocol = ["bare", "loaded", "bare"]\n'
    "[plant.errors]\ncoulomb_drift = 0.03\nviscous_drift = 0.03",
    "all together": ELASTIC % 25.0 + "backlash = 2e-4\nstribeck = 0.2\nload_friction = 0.04\ncoulomb_drift = 0.04\n"
    "coulomb_by_direction = 0.15\nbase_tilt_x = 0.001",
}
CONDITIONS = {name.replace("%%", "%"): text for name, text in CONDITIONS.items()}
MOTION_CHANGES = {"slow": (2.0, 1.0, 1.0), "short": (0.5, 0.35, 1.0), "backwards": (1.0, 1.0, -1.0)}
"""Of duration, amplitude and direction of time."""


def overlay(robot: str, condition: str) -> tuple[str, str]:
    """The scenario that a condition extends, and what it states of its own."""
    if condition in CONDITIONS:
        return ROBOTS[robot], CONDITIONS[condition]
    return (ROBOTS[robot] if condition == "as it is" else condition), ""


@dataclass(frozen=True, kw_only=True)
class Made:
    """Logs of one seed, the structure of the arm and its true gains."""

    seed: int
    motions: tuple[Motion, ...]
    structure: Structure
    gain: Array


def simulated(robot: str, condition: str, seeds: Sequence[int]) -> list[Made]:
    """What could be simulated; random numbers of one condition are those of no other."""
    base, text = overlay(robot, condition)
    own = {1000 * (zlib.crc32(f"{robot} {condition}".encode()) % 1000000) + seed: seed for seed in seeds}
    with tempfile.TemporaryDirectory() as folder:
        scenario = base
        if text:
            scenario = str(_written(Path(folder), base, condition, text))
        return [
            Made(
                seed=own[seed],
                motions=tuple(Motion(r, p) for r, p in zip(outcome.recordings, setup.mounted, strict=True)),
                structure=setup.structure,
                gain=setup.true_gain,
            )
            for seed, setup, outcome in outcomes_of(scenario, list(own))
            if isinstance(outcome, Simulated)
        ]


def _written(folder: Path, base: str, condition: str, text: str) -> Path:
    loaded = load_scenario(base)
    rotors = robot_of(loaded).drives.rotor_inertia
    soft = {f"soft{hz:g}": json.dumps((1.0 / (rotors * (2.0 * np.pi * hz) ** 2)).tolist()) for hz in SOFT}
    motion = tomllib.loads((MOTIONS / f"{loaded.table.experiment.motion}.toml").read_text(encoding="utf-8"))
    for name, (longer, larger, forwards) in MOTION_CHANGES.items():
        changed = {
            "duration": longer * motion["duration"],
            "center": motion["center"],
            "sine": (larger * forwards * np.array(motion["sine"])).tolist(),
            "cosine": (larger * np.array(motion["cosine"])).tolist(),
        }
        lines = "\n".join(f"{key} = {json.dumps(value)}" for key, value in changed.items())
        (folder / f"{name}.toml").write_text(lines, encoding="utf-8")
    path = folder / "overlay.toml"
    stated = text % soft if "%(" in text else text
    path.write_text(f'extends = "{base}"\ndescription = "{condition}"\n{stated}\n', encoding="utf-8")
    return path
