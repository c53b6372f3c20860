"""Folder of a new robot: a motion searched for it, and `robot.toml`, `scenario.toml` and the motion as files."""

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.estimation.estimators import DEFAULT
from ident.model.structure import structure_of
from ident.payload.payload import MOMENTS, Payload, payload_to_table
from ident.support.arrays import Array
from ident.support.files import read_toml
from ident.support.naming import shown
from scenarios.design.excitation import Design, Problem, finite, near_words, percents, robot_limits
from scenarios.design.new_robot import CLEAR, DEFAULTS, Given, NewRobot, Stated, assumed, described, home_pose
from scenarios.design.search import Found as Point
from scenarios.design.search import Series, about_a_pose, first_fitted, quickened
from scenarios.experiments.motions import write_motion
from scenarios.experiments.robots import check_same_payload
from scenarios.prediction.deviations import Carried, prediction_of
from scenarios.rendering.content import NONE, Line, Mood, Paragraph, Part, column, joints_named, percent, table
from scenarios.rendering.result import ResultModel
from scenarios.support.errors import ScenarioError, UnreadableFile
from scenarios.support.texts import schema_line, toml_value
from sim.errors import NoPositionError, RobotError, TrajectoryError
from sim.plant import Plant
from sim.robot import Robot, read_robot
from sim.shapes import CLEARANCE, Clearance
from sim.trajectory import FourierTrajectory

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
HARMONICS, DURATION = 6, 20.0
"""Harmonics of the motion, and period [s]."""
ATTEMPTS = 3
"""Number of searches with other seeds if a motion cannot be scaled to its limits."""
SHOWN = 0.04
"""Largest predicted relative standard deviation of a gain that the scenario requires.

Above 0.1 a gain is refused, and for a weak arm friction increases the standard deviation to up to 2.5 times the
predicted one.
"""
Searching = Callable[[Design, Series, int], Sequence[Point]]
"""Yields successively better motions of the search with this seed."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """A motion within the robot's limits, and the predicted relative standard deviation of each gain, shape (n,)."""

    motion: FourierTrajectory
    predicted: Array

    @property
    def tolerance(self) -> tuple[float, ...]:
        """Tolerances: four predicted standard deviations of each gain, at least 2 %."""
        return tuple(float(f"{max(0.02, 4.0 * min(float(each), 1.0)):.2g}") for each in self.predicted)

    @property
    def identifiable(self) -> tuple[bool, ...]:
        """Joints whose gains should be identifiable."""
        return tuple(bool(each <= SHOWN) for each in self.predicted)


class NewJoint(ResultModel):
    """Limits of a joint; in rad and N m, or in m and N for a prismatic one."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    kind: str = Field(description="revolute or prismatic")
    lower: float | None = Field(description="Lower end of the range [rad or m], null if unlimited")
    upper: float | None = Field(description="Upper end of the range [rad or m], null if unlimited")
    torque: float = Field(description="Largest torque [N m or N]")
    torque_assumed: bool = Field(description="Whether the torque is assumed")
    speed: float = Field(description="Largest speed [rad/s or m/s]")
    speed_assumed: bool = Field(description="Whether the speed is assumed")


class NewRobotResult(ResultModel):
    """What `rx90 new-robot --json` prints."""

    robot: str = Field(description="Name of the robot")
    joints: list[str] = Field(description="Names of the joints, in order")
    limits: list[NewJoint] = Field(description="Limits of the joints, in order")
    predicted_rel_std: list[float] = Field(
        description="Predicted relative standard deviation of each gain with the motion found, for residuals of 2 % of "
        "the torque"
    )
    identifiable: list[bool] = Field(description="Whether the scenario that was written requires each joint's gain")
    files: list[str] = Field(description="Files that were written")
    held: list[str] = Field(
        description="Joints recognised as those of a gripper and locked at their initial positions in the model"
    )
    payload_mass: float = Field(description="Mass of the scenario's payload [kg]")
    payload_com: list[float] = Field(description="Its centre of mass in the frame of the last link [m]")
    payload_source: str = Field(description="Origin of the payload")
    payload_warning: str | None = Field(description="Why it may be too heavy, null if nothing suggests it")
    remarks: list[str] = Field(description="Remarks on the arm, its home pose and its file")

    @classmethod
    def of(cls, new: NewRobot, found: Found, folder: Path) -> "NewRobotResult":
        """Return a robot with its motion, written into a folder."""
        torque, speed, arm, load = new.drives["current_limit"], new.drives["max_velocity"], new.arm, new.load
        limits = [
            NewJoint(
                joint=j + 1,
                kind="revolute" if arm.revolute[j] else "prismatic",
                lower=finite(arm.lower[j]),
                upper=finite(arm.upper[j]),
                torque=float(torque.value[j]),
                torque_assumed=torque.origin[j] == "assumed",
                speed=float(speed.value[j]),
                speed_assumed=speed.origin[j] == "assumed",
            )
            for j in range(arm.n)
        ]
        return cls(
            robot=new.name,
            joints=list(arm.joint_names),
            limits=limits,
            predicted_rel_std=found.predicted.tolist(),
            identifiable=list(found.identifiable),
            files=[str(folder / name) for name in FILES],
            held=list(new.end.held),
            payload_mass=load.body.mass,
            payload_com=list(load.body.com),
            payload_source=load.source,
            payload_warning=load.warning or None,
            remarks=list(_remarks(new)),
        )

    def parts(self) -> Iterator[Part]:
        """Return verdict, joints with marks of assumed limits, payload, remarks, next command."""
        sizes = [100.0 * std for std, ok in zip(self.predicted_rel_std, self.identifiable, strict=True) if ok]
        none = [j for j, ok in enumerate(self.identifiable, 1) if not ok]
        if sizes:
            size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(sizes), max(sizes))))
            but = f", not of {joints_named(none)}" if none else ""
            words = f"{len(sizes)} of {len(self.joints)} gains are identifiable{but}"
            mood = Mood.DOUBTFUL if none else Mood.GOOD
            yield Paragraph(f"{words}; predicted standard deviation {size} %.", mood, strong=True)
        else:
            yield Paragraph("No gain is identifiable with this motion and payload.", Mood.BAD, strong=True)
        kinds = {each.kind for each in self.limits}
        units = [of for kind, of in (("revolute", ("rad", "N m")), ("prismatic", ("m", "N"))) if kind in kinds]
        place, effort = (", ".join(each) for each in zip(*units, strict=True))
        rate = ", ".join(f"{length}/s" for length, _ in units)

        def end(limit: float | None) -> str:
            return NONE if limit is None else f"{limit:.4g}"

        yield table(
            self.limits,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: self.joints[each.joint - 1], words=True),
            column("Kind", lambda each: each.kind, words=True),
            column(f"From [{place}]", lambda each: end(each.lower)),
            column(f"To [{place}]", lambda each: end(each.upper)),
            column(f"Torque [{effort}]", lambda each: f"{each.torque:.4g}{'*' * each.torque_assumed}"),
            column(f"Speed [{rate}]", lambda each: f"{each.speed:.4g}{'*' * each.speed_assumed}"),
            column("Predicted [%]", lambda each: percent(self.predicted_rel_std[each.joint - 1], ".2f")),
            column("Identifiable", lambda each: "yes" if self.identifiable[each.joint - 1] else "no", words=True),
        )
        yield Paragraph(
            "Check order and names of the joints against your controller's. Values marked * are assumed. Gains, "
            "friction, rotor inertias and payload are also assumed, by the defaults noted in robot.toml. Predicted: "
            "standard deviation of the gain with the motion found, for residuals of 2 % of the torque."
        )
        yield Paragraph(
            f"Payload: {self.payload_mass:g} kg, centre {self.payload_com} m in the frame of the last link; "
            f"{self.payload_source}."
        )
        if self.payload_warning:
            yield Paragraph(f"WARNING: payload: {self.payload_warning}.", Mood.DOUBTFUL)
        yield from map(Paragraph, self.remarks)
        folder = Path(self.files[0]).parent
        yield Paragraph(f"{', '.join(FILES)} in {folder}. Next:")
        yield Line(f"rx90 run {shlex.quote(str(folder / SCENARIO))}")


def _remarks(new: NewRobot) -> Iterator[str]:
    """Yield remarks on the arm, its home pose and its file."""
    if new.end.held:
        yield (
            f"Recognised as joints of a gripper and locked: {', '.join(new.end.held)}. "
            f"The arm ends at body {new.end.flange}, "
            "which carries the payload; name another last body with --flange."
        )
    if new.home_clearance < CLEAR:
        yield f"Home {near_words(new.home_clearance)} floor or arm; give a pose clear of both with --home."
    if new.always_near:
        near = ", ".join(f"{one} and {other}" for one, other in new.always_near)
        yield f"Within {1e3 * CLEARANCE:g} mm of each other at all positions, so their distance is not checked: {near}."
    if new.facts.left:
        yield (
            f"The file's {', '.join(new.facts.left)} of joints are ignored, as they often serve only numerical "
            f"stability. Friction and rotor inertias in robot.toml are defaults; replace "
            "them by measured values."
        )
    if new.facts.from_shapes:
        links = ", ".join(new.facts.from_shapes)
        yield f"The file states no inertia of these links, so it is computed from their shapes: {links}."
    if missing := new.facts.missing_meshes:
        yield (
            f"Meshes that are missing or cannot be compiled: {len(missing)} (first: {missing[0]}); clearance is "
            "checked without them."
        )


def new_robot(path: Path, folder: Path, given: Given) -> NewRobot:
    """Read a model file, complete it by defaults, and choose its home pose.

    Raises:
        RobotModelError: If identification and simulation read the file differently; otherwise as `described`.
    """
    new = described(path, folder, given)
    robot = as_read(new)
    check_same_payload(new.arm, robot)
    clearance = Clearance(Plant(robot=robot, drives=robot.drives, payload=new.load.body), margin=3.0 * CLEARANCE)
    home = home_pose(new.arm, new.facts, clearance, given.home)
    distance = float(clearance(home.value[None])[0])
    return replace(new, home=home, home_clearance=distance, always_near=clearance.always_near)


def moved(new: NewRobot, searched: Searching, *, advice: str) -> Found:
    """Search for a motion that identifies all gains.

    Raises:
        TrajectoryError: If none is found.
        RobotError: If the payload that the arm can carry identifies no gain.
    """
    robot, body = as_read(new), new.load.body
    plant = Plant(robot=robot, drives=robot.drives, payload=body)
    problem = Problem(
        plant=plant,
        structure=structure_of(new.arm),
        limits=robot_limits(plant),
        joints=np.arange(new.arm.n),
        carried=Carried.nominal(new.load.payload),
        prediction=prediction_of(DEFAULT),
    )
    design = Design(problem)
    series = Series(limits=problem.limits, harmonics=HARMONICS, duration=DURATION)
    bests: list[FourierTrajectory] = []

    def searches() -> Iterator[Sequence[Point]]:
        for attempt in range(ATTEMPTS):
            kept = searched(design, series, attempt)
            bests.append(series.motion(kept[-1].x))
            yield kept

    try:
        motion = first_fitted(design, series, searches())
    except NoPositionError as error:
        raise TrajectoryError(f"{error}: --payload KG; or name a pose that can be held and is clear, --home") from error
    except TrajectoryError as error:
        smaller = [small for best in bests for small in about_a_pose(design, best)]
        if not smaller:
            said = f"robot {new.name}: {ATTEMPTS} searches for a motion failed: {error}; {advice}"
            raise TrajectoryError(said) from error
        motion = min(smaller, key=design.cost)
    motion = quickened(design, motion)
    found = Found(motion=motion, predicted=design.deviations(design.rows(motion)).total)
    if any(found.identifiable):
        return found
    raise RobotError(
        f"robot {new.name}: the torque limits allow a payload of {body.mass:.2g} kg, which determines no gain "
        f"better than {two_digits(100.0 * found.predicted.min())} %; correct effort or force ranges, or masses of "
        "the links, or state what the arm may carry with --rated-load"
    )


def robot_text(new: NewRobot) -> str:
    """Return the text of the robot file."""
    lines = [
        schema_line("robot"),
        f"# Joints: {', '.join(f'{k} {name}' for k, name in enumerate(new.arm.joint_names, 1))}",
        "# A first version: replace assumed values by known ones. origin is published, measured or assumed, one",
        "# word or one per joint. Units of a prismatic joint are in brackets.",
        f"name = {toml_value(new.name)}",
        f"model = {toml_value(new.model)}  # masses, centres and inertias of links are those of this file",
    ]
    if new.end.flange is not None:
        flange = toml_value(new.end.flange)
        lines.append(f"flange = {flange}  # last body of the arm; joints outside the chain to it are locked")
    if new.rated_load is not None:
        words = assumed(np.array([new.rated_load]), "given to rx90 new-robot")
        lines += ["", "[rated_load]  # kg; upper limit of what `rx90 payload` designs", *_stated(words, several=False)]
    lines += ["", "[home]  # rad (m)", *_stated(new.home)]
    for name, stated in new.drives.items():
        turns, slides = UNITS[name]
        unit = turns if new.arm.revolute.all() or turns == slides else f"{turns} ({slides})"
        lines += ["", f"[drives.{name}]  # {unit}", *_stated(stated)]
    return "\n".join(lines) + "\n"


def _stated(stated: Stated, *, several: bool = True) -> list[str]:
    one = len(set(stated.origin)) == 1
    value = [float(f"{x:.6g}") for x in stated.value]
    return [
        f"value = {value if several else value[0]!r}",
        f"origin = {toml_value(stated.origin[0] if one else stated.origin)}",
        f"source = {toml_value(stated.source)}",
    ]


def scenario_text(new: NewRobot, found: Found) -> str:
    """Return the text of the scenario file."""
    true, believed = (_payload(new.load.payload, deviations=each) for each in (False, True))
    resonance, zeros = DEFAULTS["resonance"], DEFAULTS["zeros"]
    soft = [1.0 / (float(ia) * (2.0 * np.pi * resonance.second) ** 2) for ia in new.drives["rotor_inertia"].value]
    soft = [float(f"{c:.3g}") for c in soft]
    more = [float(f"{c * ((resonance.second / resonance.value) ** 2 - 1.0):.3g}") for c in soft]
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

[sources."joint elasticity"]  # assumed: {resonance.source}
target = "plant.errors.joint_compliance"
distribution = "uniform"
parameters = {{ loc = {soft!r}, scale = {more!r} }}  # rad/(N m), m/N for a prismatic joint
shared = true

[sources."zeros of joints"]  # assumed: {zeros.source}
target = "plant.errors.zero_error"
distribution = "norm"
parameters = {{ scale = {[zeros.value if turns else zeros.second for turns in new.arm.revolute]!r} }}  # rad, m for a \
prismatic joint
"""


def _payload(payload: Payload, *, deviations: bool) -> str:
    """Return a payload as a table in one line without zeros, with or without its standard deviations."""
    table: dict[str, object] = {}
    for key, value in payload_to_table(payload).items():
        if key == "known" or (key.endswith("_std") and not deviations):
            continue
        if isinstance(value, dict):
            kept = {name: x for name, x in value.items() if x or (name in MOMENTS and any(value.values()))}
            table |= {key: kept} if kept else {}
        elif np.any(np.array(value)):
            table[key] = value
    return toml_value(table)


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
