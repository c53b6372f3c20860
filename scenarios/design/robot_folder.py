"""Folder of a user's robot: `robot.toml`, `scenario.toml` and a motion; every number with its origin."""

import os
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ident.payload.payload import INERTIA_KEYS, MOMENTS, Payload
from ident.support.naming import shown
from ident.support.toml_files import read_toml
from scenarios.design.new_robot import SHOWN, Found, NewRobot
from scenarios.design.rules_of_thumb import Stated, assumed
from scenarios.design.searched_motion import percents
from scenarios.experiments.files.motions import write_motion
from scenarios.experiments.files.toml_text import schema_line, toml_value
from scenarios.support.errors import ScenarioError, UnreadableFile
from sim.robot import Robot
from sim.robot_files import read_robot

ROBOT, SCENARIO, MOTION = "robot.toml", "scenario.toml", "motion.toml"
FILES = (ROBOT, SCENARIO, MOTION)
MADE = "Found by rx90 new-robot, within the limits of robot.toml; rx90 excite finds a better one"
UNITS = {
    "gain": ("N m / drive unit", "N / drive unit"),
    "rotor_inertia": ("kg m^2", "kg"),
    "viscous_friction": ("N m s/rad", "N s/m"),
    "coulomb_friction": ("N m", "N"),
    "coulomb_asymmetry": ("N m", "N"),
    "amplifier_offset": ("drive units", "drive units"),
    "current_limit": ("drive units", "drive units"),
    "max_velocity": ("rad/s", "m/s"),
    "max_acceleration": ("rad/s^2", "m/s^2"),
}
"""Units of the tables of `[drives]`, for revolute and prismatic joints."""
SWING = (20.0, 30.0)
"""Range of the rotor resonance on an elastic transmission [Hz]; measured joints have 20 to 31."""


def robot_text(new: NewRobot) -> str:
    """Return the text of the robot file."""
    names = ", ".join(f"{k} {name}" for k, name in enumerate(new.arm.joint_names, 1))
    lines = [
        schema_line("robot"),
        f"# Joints: {names}",
        "# A first version: replace assumed values by known ones. origin is published, measured or assumed, one",
        "# word or one per joint. Units of a prismatic joint are in brackets.",
        f"name = {toml_value(new.name)}",
        f"model = {toml_value(new.model)}  # masses, centres and inertias of links are those of this file",
    ]
    if new.end.flange is not None:
        lines.append(
            f"flange = {toml_value(new.end.flange)}  # last body of the arm; joints outside the chain to it are locked"
        )
    if new.load.rated is not None:
        words = assumed(np.array([new.load.rated]), "given to rx90 new-robot")
        lines += ["", "[rated_load]  # kg; upper limit of what `rx90 payload` designs", *_stated(words, several=False)]
    lines += ["", "[home]  # rad (m)", *_stated(new.home)]
    for name, stated in new.drives.items():
        turns, slides = UNITS[name]
        unit = turns if new.arm.revolute.all() or turns == slides else f"{turns} ({slides})"
        lines += ["", f"[drives.{name}]  # {unit}", *_stated(stated)]
    return "\n".join(lines) + "\n"


def scenario_text(new: NewRobot, found: Found) -> str:
    """Return the text of the scenario file."""
    true, believed = (_payload(new.load.payload, deviations=each) for each in (False, True))
    soft = [1.0 / (float(ia) * (2.0 * np.pi * SWING[1]) ** 2) for ia in new.drives["rotor_inertia"].value]
    soft = [float(f"{c:.3g}") for c in soft]
    zeros = [0.00175 if turns else 0.0001 for turns in new.arm.revolute]
    more = [float(f"{c * ((SWING[1] / SWING[0]) ** 2 - 1.0):.3g}") for c in soft]
    truth = ", ".join("true" if each else "false" for each in found.identifiable)
    return f"""{schema_line("scenario")}
extends = "any-arm"          # controller, sensors and error sources that all arms share
description = {toml_value(f"{new.name} as its model file describes it, with drives and friction by rules of thumb")}
robot = "{ROBOT}"         # beside this file

[plant]                      # what is true; drives that are not stated are those of {ROBOT}
payload = {true}
# {new.load.source}
# kg, m in the frame of the last link, kg m^2 about the centre of mass

[experiment]
motion = "{MOTION}"       # found within the limits of {ROBOT}; rx90 excite finds a better one

[belief]                     # what controller and identification assume
controller_gain = {new.drives["gain"].value.tolist()!r}  # those of {ROBOT}
payload = {believed}  # as it is

[tolerance]
gain = {list(found.tolerance)!r}  # relative; four predicted standard deviations, 2 % at least
identifiable = [{truth}]  # predicted standard deviations [%]: {percents(found.predicted)}; limit: {100.0 * SHOWN:g}

[sources."joint elasticity"]  # assumed: rotor resonances on the transmissions at {SWING[0]:g} to {SWING[1]:g} Hz
target = "plant.errors.joint_compliance"
distribution = "uniform"
parameters = {{ loc = {soft!r}, scale = {more!r} }}  # rad/(N m), m/N for a prismatic joint
shared = true

[sources."zeros of joints"]  # assumed: 0.1 degrees, 0.1 mm for a prismatic joint: a calibrated arm
target = "plant.errors.zero_error"
distribution = "norm"
parameters = {{ scale = {zeros!r} }}  # rad, m for a prismatic joint
"""


def as_read(new: NewRobot) -> Robot:
    """Return the robot as read from its file, without leaving the file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / ROBOT
        path.write_text(robot_text(replace(new, model=str(new.path.resolve()))), encoding="utf-8")
        return read_robot(path)


def write_new_robot(new: NewRobot, found: Found, folder: Path) -> None:
    """Write all files or none: each is complete before the first is moved to its place.

    Raises:
        OSError: If something cannot be written.
    """
    with TemporaryDirectory(dir=folder, prefix=".new-robot-") as staging:
        there = Path(staging)
        (there / ROBOT).write_text(robot_text(new), encoding="utf-8")
        (there / SCENARIO).write_text(scenario_text(new, found), encoding="utf-8")
        write_motion(found.motion, there / MOTION, [MADE])
        for name in FILES:
            os.replace(there / name, folder / name)


def check_no_other_robot(folder: Path, model: Path) -> None:
    """Check that a folder has no robot of another model file.

    Raises:
        ScenarioError: If it does.
    """
    path = folder / ROBOT
    try:
        table = read_toml(path, error=UnreadableFile)
    except UnreadableFile:  # empty, or nothing of value
        return
    name, there = table.get("name"), table.get("model")
    if isinstance(there, str) and (folder / there).resolve() != model.resolve():
        raise ScenarioError(
            f"{path}: is of another robot, {shown(name)} from {shown(there)}; give another folder, or add --force"
        )


def _payload(payload: Payload, *, deviations: bool) -> str:
    """Return a payload as a table in one line, with or without its standard deviations."""
    keys = ("mass", "com", "inertia", *("mass_std", "com_std", "inertia_std") * deviations)
    values = {key: getattr(payload, key) for key in keys}
    for key in ("inertia", "inertia_std"):
        if any(values.get(key, ())):
            pairs = zip(INERTIA_KEYS, values[key], strict=True)
            values[key] = {name: x for name, x in pairs if x or name in MOMENTS}
    return toml_value({key: value for key, value in values.items() if np.any(value) or isinstance(value, dict)})


def _stated(stated: Stated, *, several: bool = True) -> list[str]:
    words = set(stated.origin)
    origin = toml_value(stated.origin[0]) if len(words) == 1 else toml_value(stated.origin)
    value = [float(f"{x:.6g}") for x in stated.value]
    return [
        f"value = {value if several else value[0]!r}",
        f"origin = {origin}",
        f"source = {toml_value(stated.source)}",
    ]
