"""A quick scenario with payloads by name and a protocol of its own."""

import json
from pathlib import Path

from quick import BRIEF, quick_scenario

from scenarios.experiments.scenario import Setup, load_scenario, setup_of

TWO = """
[plant.payloads]
light = "4.275 kg"
heavy = { mass = 6.5, com = [0.01, -0.02, 0.13], inertia = { ixx = 0.011, iyy = 0.012, izz = 0.008 } }
[belief.payloads]
light = "4.275 kg"
heavy = { mass = 6.6, mass_std = 0.1, com = [0.0, 0.0, 0.13], inertia = { ixx = 0.011, iyy = 0.012, izz = 0.008 } }
"""
FOUR = ("bare", "light", "heavy", "bare")


def scenario_of(folder: Path, protocol: tuple[str, ...], more: str = "", lasts: float = BRIEF) -> str:
    """A quick scenario with a protocol of its own and payloads `loaded`, `light` and `heavy`."""
    quick_scenario(folder, lasts=lasts)
    path = folder / "mine.toml"
    path.write_text(f'extends = "quick.toml"\nexperiment.protocol = {json.dumps(protocol)}\n{TWO}{more}')
    return str(path)


def protocol_setup(folder: Path, protocol: tuple[str, ...], more: str = "", lasts: float = BRIEF) -> Setup:
    return setup_of(load_scenario(scenario_of(folder, protocol, more, lasts)))
