"""A scenario that runs in a twentieth of a second a trial: a short motion, gains joint by joint."""

from pathlib import Path

from plants import short_motion

from scenarios.experiments.motions import write_motion
from scenarios.experiments.scenario_files import CATALOG

TEXT = """extends = "nominal"
[experiment]
motion = "short.toml"
step = 0.002
controller.rate_hz = 500.0
[tolerance]
gain = [0.2, 0.03, 0.03, 0.2, 0.03, 0.03]
identifiable = [true, true, true, false, true, false]
[identification]
method = "{method}"
"""
RANDOM = """
[random.gains]
target = "plant.gain"
distribution = "norm"
parameters = { loc = 1.0, scale = 0.1 }
apply = "multiply"
[random.load]
target = "plant.payload.mass"
choice = [7.025, 7.0, 95.0]
"""
SOURCES = """
[identification]
method = "ls-2011"
[sources.mass]
target = "plant.payload.mass"
distribution = "norm"
parameters = { scale = 0.1 }
apply = "add"
[sources.white]
target = "experiment.sensors.current_white"
stream = "white"
off = 0.0
"""
SENSORS = "experiment.sensors."
QUIET = {f"{SENSORS}{name}": 0.0 for name in ("encoder_quantum", "encoder_noise", "current_white", "current_coloured")}
"""Settings without noise."""
FULL_RATE = {"experiment.step": 0.001, "experiment.controller.rate_hz": 1000.0}
BRIEF = 4.0
"""Seconds that are enough where trials are counted and compared, and no gain is judged."""


def quick_scenario(folder: Path, more: str = "", method: str = "ls-2011", lasts: float = 6.0) -> Path:
    """A scenario file beside its motion; with `RANDOM`, a third of the trials are too heavy for the drives."""
    write_motion(short_motion(lasts, 0.25), folder / "short.toml", [])
    path = folder / "quick.toml"
    path.write_text(TEXT.format(method=method) + more)
    return path


def two_sources(folder: Path, motion: str = "drive-gains") -> Path:
    """`nominal` with two error sources of its own; `extends` would bring all sources of `nominal` along."""
    nominal = (CATALOG / "nominal.toml").read_text().partition("# Error sources")[0]
    assert 'motion = "drive-gains"' in nominal
    path = folder / "two.toml"
    path.write_text(nominal.replace('motion = "drive-gains"', f'motion = "{motion}"') + SOURCES)
    return path
