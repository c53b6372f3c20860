"""Folder of a new robot: a motion within its limits, and `robot.toml`, `scenario.toml` and the motion as files."""

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from pydantic import Field

from ident.diagnosis.diagnosis import two_digits
from scenarios.design.excitation import Design, finite, near_words
from scenarios.design.new_robot import CLEAR, MOTION, ROBOT, SCENARIO, SHOWN, TURNED, NewRobot
from scenarios.design.search import Found, Series, best_fitted
from scenarios.experiments.motions import write_motion
from scenarios.rendering.content import Line, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import NONE, joints_named, percent
from sim.errors import NO_POSITION, PlantError, TrajectoryError
from sim.shapes import CLEARANCE
from sim.trajectory import FourierTrajectory

FILES = (ROBOT, SCENARIO, MOTION)
ATTEMPTS = 3
"""Number of searches with other seeds until a motion identifies all gains."""
HARMONICS, DURATION, TIMES = 6, 20.0, 2
"""Harmonics of the motion, its duration [s], and how often its path is passed.

Passed once, joint 1 of the RX-90 moves so slowly that the predicted deviation of its gain is 20 times as large.
"""


class NewJoint(ResultModel):
    """Limits of a joint; in rad and N m, or in m and N for a prismatic one."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    kind: str  # revolute or prismatic
    lower: float | None  # lower end of the range [rad or m], null if unlimited
    upper: float | None  # upper end of the range [rad or m], null if unlimited
    torque: float  # largest torque [N m or N]
    torque_assumed: bool  # whether the torque is assumed
    speed: float  # largest speed [rad/s or m/s]
    speed_assumed: bool  # whether the speed is assumed


class NewRobotResult(ResultModel):
    """What `rx90 new-robot --json` prints."""

    robot: str  # name of the robot
    joints: list[str]  # names of the joints, in order
    limits: list[NewJoint]  # limits of the joints, in order
    predicted_rel_std: list[float] = Field(
        description="Predicted relative standard deviation of each gain with the motion found, for residuals of 2 % of "
        "the torque"
    )
    identifiable: list[bool]  # whether the scenario that was written requires each joint's gain
    files: list[str]  # files that were written
    payload_mass: float  # mass of the scenario's payload [kg]
    payload_com: list[float]  # its centre of mass in the frame of the last link [m]
    payload_source: str  # origin of the payload
    payload_warning: str | None  # why it may be too heavy, null if nothing suggests it
    remarks: list[str]  # remarks on the arm, its home pose and its file

    def parts(self) -> Iterator[Part]:
        """Return verdict, joints with marks of assumed limits, payload, remarks, next command."""
        sizes = [std for std, ok in zip(self.predicted_rel_std, self.identifiable, strict=True) if ok]
        none = [j for j, ok in enumerate(self.identifiable, 1) if not ok]
        size = " to ".join(dict.fromkeys(two_digits(100.0 * each) for each in (min(sizes), max(sizes))))
        but = f", not of {joints_named(none)}" if none else ""
        words = f"{len(sizes)} of {len(self.joints)} gains are identifiable{but}"
        mood = Mood.DOUBTFUL if none else Mood.GOOD
        yield Paragraph(f"{words}; predicted standard deviation {size} %.", mood, strong=True)
        yield table(
            list(zip(self.joints, self.limits, self.predicted_rel_std, self.identifiable, strict=True)),
            column("Joint", lambda row: row[1].joint),
            column("Name", lambda row: row[0], words=True),
            column("Kind", lambda row: row[1].kind, words=True),
            column("From", lambda row: NONE if row[1].lower is None else f"{row[1].lower:.4g}"),
            column("To", lambda row: NONE if row[1].upper is None else f"{row[1].upper:.4g}"),
            column("Torque", lambda row: f"{row[1].torque:.4g}{'*' * row[1].torque_assumed}"),
            column("Speed", lambda row: f"{row[1].speed:.4g}{'*' * row[1].speed_assumed}"),
            column("Predicted [%]", lambda row: percent(row[2], ".2f")),
            column("Identifiable", lambda row: "yes" if row[3] else "no", words=True),
        )
        yield Paragraph(
            "In rad, N m and rad/s; m, N and m/s for prismatic joints. Check order and names of the joints against "
            "your controller's. Values marked * are assumed. Gains, friction, rotor inertias and payload are also "
            "assumed, by the defaults noted in robot.toml. Predicted: standard deviation of the gain with the motion "
            "found, for residuals of 2 % of the torque."
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


def found_motion(
    new: NewRobot, folder: Path, search: Callable[[Design, Series, int], Sequence[Found]], *, advice: str
) -> tuple[FourierTrajectory, NewRobotResult]:
    """Find a motion that identifies the gains of a new robot; `search` returns ever better ones of an attempt, from 0.

    Raises `TrajectoryError`, with `advice`, if there is none, `PlantError` if the payload identifies no gain.
    """
    design, arm, payload = new.design(), new.arm, new.payload
    series = Series.harmonic(design.limits, HARMONICS, DURATION, TIMES)
    motions, failed = list[FourierTrajectory](), None
    for attempt in range(ATTEMPTS):
        try:
            motions.append(best_fitted(design, series, search(design, series, attempt)))
        except TrajectoryError as error:
            if error.kind == NO_POSITION:
                said = "--payload KG; or state --torque, or name a pose that can be held and is clear, --home"
                raise TrajectoryError(f"{error}: {said}", kind=NO_POSITION) from error
            failed = error
        if motions and (design.deviations(motions[-1]) <= SHOWN).all():
            break
    if not motions:
        raise TrajectoryError(f"robot {new.name}: {ATTEMPTS} searches for a motion failed: {failed}; {advice}")
    motion = min(motions, key=design.cost)
    predicted = design.deviations(motion)
    if (predicted > SHOWN).all():
        raise PlantError(
            f"robot {new.name}: with its payload of {payload.mass:.2g} kg, no gain is determined better than "
            f"{two_digits(100.0 * predicted.min())} %; correct effort or force ranges, or link masses, or state "
            "what the arm may carry with --rated-load"
        )
    torque, speed = new.drives["current_limit"], new.drives["max_velocity"]
    return motion, NewRobotResult(
        robot=new.name,
        joints=list(arm.joint_names),
        limits=[
            NewJoint(
                joint=j + 1,
                kind="revolute" if arm.revolute[j] else "prismatic",
                lower=finite(arm.lower[j]),
                upper=finite(arm.upper[j]),
                torque=float(torque.value[j]),
                torque_assumed=torque.assumed(j),
                speed=float(speed.value[j]),
                speed_assumed=speed.assumed(j),
            )
            for j in range(arm.n)
        ],
        predicted_rel_std=predicted.tolist(),
        identifiable=(predicted <= SHOWN).tolist(),
        files=[str(folder / name) for name in FILES],
        payload_mass=payload.mass,
        payload_com=list(payload.com or ()),
        payload_source=new.payload_source,
        payload_warning=new.payload_warning,
        remarks=list(_remarks(new, design)),
    )


def _remarks(new: NewRobot, design: Design) -> Iterator[str]:
    facts, distance = new.facts, float(design.clearance(new.home.value[None])[0])
    near = ", ".join(f"{one} and {other}" for one, other in design.clearance.always_near)
    if new.transmission is not None:
        yield f"Motors on tendons of the file turn several joints: transmission in {ROBOT}; {TURNED}."
    if facts.locked:
        yield f"Locked, as they are not joints of the chain to {new.flange}: {', '.join(facts.locked)}."
    if distance < CLEAR:
        yield f"Home {near_words(distance)} floor or arm; give a pose clear of both with --home."
    if near:
        apart = f"{1e3 * CLEARANCE:g} mm of each other at nearly all positions"
        yield f"Within {apart}, so their distance is not checked: {near}."
    if facts.ignored:
        yield (
            f"The file's {', '.join(facts.ignored)} of joints are ignored, as they often serve only numerical "
            "stability. Friction and rotor inertias in robot.toml are defaults; replace them by measured values."
        )
    if links := ", ".join(facts.from_shapes):
        yield f"The file states no inertia of these links, so it is computed from their shapes: {links}."
    if meshes := ", ".join(facts.missing_meshes):
        yield f"Meshes that are missing or cannot be compiled, so clearance is checked without them: {meshes}."


def write_new_robot(new: NewRobot, motion: FourierTrajectory, predicted: Sequence[float], folder: Path) -> None:
    """Write all files or none: each is complete before the first is moved to its place."""
    with TemporaryDirectory(dir=folder, prefix=".new-robot-") as staging:
        there = Path(staging)
        new.write(there, os.path.relpath(new.path.resolve(), folder.resolve()), predicted)
        made = "Found by rx90 new-robot, within the limits of robot.toml; rx90 excite finds a better one"
        write_motion(motion, there / MOTION, [made])
        for name in FILES:
            os.replace(there / name, folder / name)
