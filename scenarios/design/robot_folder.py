"""Folder of a new robot: a motion within its limits, and `robot.toml`, `scenario.toml` and the motion as files."""

import os
import shlex
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import two_digits
from ident.estimation.estimators import DEFAULT
from ident.model.structure import structure_of
from ident.payload.payload import payload_to_table
from ident.support.files import read_toml
from ident.support.naming import shown
from scenarios.design.excitation import Design, Limits, finite, near_words, percents
from scenarios.design.new_robot import CLEAR, DEFAULTS, NewRobot
from scenarios.design.parametrisations import Series
from scenarios.design.search import Found, best_fitted
from scenarios.experiments.motions import write_motion
from scenarios.experiments.scenario import body_of
from scenarios.prediction.deviations import Carried, prediction_of
from scenarios.rendering.content import NONE, Line, Mood, Paragraph, Part, column, joints_named, percent, table
from scenarios.rendering.result import ResultModel
from scenarios.support.errors import ScenarioError
from scenarios.support.texts import schema_line, toml_value
from sim.errors import NoPosition, PlantError, TrajectoryError
from sim.plant import Plant
from sim.shapes import CLEARANCE
from sim.trajectory import FourierTrajectory

ROBOT, SCENARIO, MOTION = "robot.toml", "scenario.toml", "motion.toml"
FILES = (ROBOT, SCENARIO, MOTION)
MADE = "Found by rx90 new-robot, within the limits of robot.toml; rx90 excite finds a better one"
ATTEMPTS = 3
"""Number of searches with other seeds until a motion identifies all gains."""
HARMONICS, DURATION = 6, 20.0
"""Harmonics of the motion, and period [s]."""
QUICKEST = 1.5
"""Highest harmonic of an accelerated motion [Hz]: position loops of arms follow it, and filters of logs pass it."""
SHOWN = 0.04
"""Largest predicted relative standard deviation of a gain that the scenario requires.

Above 0.1 a gain is refused, and for a weak arm friction increases the standard deviation to up to 2.5 times the
predicted one.
"""


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

    def parts(self) -> Iterator[Part]:
        """Return verdict, joints with marks of assumed limits, payload, remarks, next command."""
        sizes = [100.0 * std for std, ok in zip(self.predicted_rel_std, self.identifiable, strict=True) if ok]
        none = [j for j, ok in enumerate(self.identifiable, 1) if not ok]
        size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(sizes), max(sizes))))
        but = f", not of {joints_named(none)}" if none else ""
        words = (
            f"{len(sizes)} of {len(self.joints)} gains are identifiable{but}; predicted standard deviation {size} %."
        )
        yield Paragraph(words, Mood.DOUBTFUL if none else Mood.GOOD, strong=True)
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


def found_motion(
    new: NewRobot, folder: Path, search: Callable[[Design, Series, int], Sequence[Found]], *, advice: str
) -> tuple[FourierTrajectory, NewRobotResult]:
    """Find a motion that identifies the gains of a new robot, for the files in a folder.

    Args:
        new: The robot.
        folder: The folder.
        search: Returns successively better motions of a search, the best last; searches are numbered from 0.
        advice: What to try if no motion is found.

    Raises:
        TrajectoryError: If none is found.
        PlantError: If the payload that the arm can carry identifies no gain.
    """
    robot, arm, payload = new.robot(), new.arm, new.payload
    plant = Plant(robot=robot, drives=robot.drives, payload=body_of(payload))
    limits = Limits.of(plant)
    design = Design(
        plant=plant,
        structure=structure_of(arm),
        limits=limits,
        joints=np.arange(arm.n),
        carried=Carried.nominal(payload),
        prediction=prediction_of(DEFAULT),
    )
    series = Series(limits=limits, harmonics=HARMONICS, duration=DURATION)
    motions, failed = list[FourierTrajectory](), None
    for attempt in range(ATTEMPTS):
        try:
            motions.append(best_fitted(design, series, search(design, series, attempt)))
        except NoPosition as error:
            said = f"{error}: --payload KG; or name a pose that can be held and is clear, --home"
            raise NoPosition(said) from error
        except TrajectoryError as error:
            failed = error
        if motions and (design.deviations(motions[-1]) <= SHOWN).all():
            break
    if not motions:
        raise TrajectoryError(f"robot {new.name}: {ATTEMPTS} searches for a motion failed: {failed}; {advice}")
    motion = quickened(design, min(motions, key=design.cost))
    predicted = design.deviations(motion)
    if (predicted > SHOWN).all():
        raise PlantError(
            f"robot {new.name}: the torque limits allow a payload of {payload.mass:.2g} kg, which determines no gain "
            f"better than {two_digits(100.0 * predicted.min())} %; correct effort or force ranges, or masses of "
            "the links, or state what the arm may carry with --rated-load"
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
                torque_assumed=torque.origin[j] == "assumed",
                speed=float(speed.value[j]),
                speed_assumed=speed.origin[j] == "assumed",
            )
            for j in range(arm.n)
        ],
        predicted_rel_std=predicted.tolist(),
        identifiable=(predicted <= SHOWN).tolist(),
        files=[str(folder / name) for name in FILES],
        held=list(new.held),
        payload_mass=payload.mass,
        payload_com=list(plant.payload.com),
        payload_source=new.payload_source,
        payload_warning=new.payload_warning or None,
        remarks=list(_remarks(new, design)),
    )


def quickened(design: Design, motion: FourierTrajectory) -> FourierTrajectory:
    """Return the motion, or the same path repeated faster within the period, whichever is more accurate.

    Ranges and distances limit a search in few slow harmonics, far below the rated speeds of the joints. Repeated k
    times, harmonic h of a path becomes harmonic k h.
    """
    best, harmonics = motion, motion.sine.shape[1]
    for times in range(2, int(QUICKEST * motion.duration / harmonics) + 1):
        sine, cosine = (np.zeros((motion.n, times * harmonics)) for _ in range(2))
        sine[:, times - 1 :: times], cosine[:, times - 1 :: times] = motion.sine, motion.cosine
        quick = FourierTrajectory(motion.center, sine, cosine, motion.duration)
        if not design.keeps_limits(quick):
            break
        best = min(best, quick, key=design.cost)
    return best


def _remarks(new: NewRobot, design: Design) -> Iterator[str]:
    """Yield remarks on the arm, its home pose and its file."""
    if new.held:
        yield (
            f"Recognised as joints of a gripper and locked: {', '.join(new.held)}. The arm ends at body {new.flange}, "
            "which carries the payload; name another last body with --flange."
        )
    distance = float(design.clearance(new.home.value[None])[0])
    if distance < CLEAR:
        yield f"Home {near_words(distance)} floor or arm; give a pose clear of both with --home."
    if near := design.clearance.always_near:
        pairs, mm = ", ".join(f"{one} and {other}" for one, other in near), 1e3 * CLEARANCE
        yield f"Within {mm:g} mm of each other at all positions, so their distance is not checked: {pairs}."
    if new.facts.ignored:
        yield (
            f"The file's {', '.join(new.facts.ignored)} of joints are ignored, as they often serve only numerical "
            "stability. Friction and rotor inertias in robot.toml are defaults; replace them by measured values."
        )
    if links := new.facts.from_shapes:
        yield (f"The file states no inertia of these links, so it is computed from their shapes: {', '.join(links)}.")
    if missing := new.facts.missing_meshes:
        yield (
            f"Meshes that are missing or cannot be compiled: {len(missing)} (first: {missing[0]}); clearance is "
            "checked without them."
        )


def scenario_text(new: NewRobot, predicted: Sequence[float]) -> str:
    """Return the text of the scenario file. `predicted` are relative standard deviations of the gains."""
    believed = {key: value for key, value in payload_to_table(new.payload).items() if key != "known"}
    true = {key: value for key, value in believed.items() if not key.endswith("_std")}
    tolerance = [float(f"{max(0.02, 4.0 * min(each, 1.0)):.2g}") for each in predicted]
    resonance, zeros = DEFAULTS["resonance"], DEFAULTS["zeros"]
    stiffest = 1.0 / (new.drives["rotor_inertia"].value * (2.0 * np.pi * resonance.second) ** 2)
    soft = [float(f"{c:.3g}") for c in stiffest]
    more = [float(f"{c * ((resonance.second / resonance.value) ** 2 - 1.0):.3g}") for c in soft]
    return f"""{schema_line("scenario")}
extends = "any-arm"          # controller, sensors and error sources that all arms share
description = {toml_value(f"{new.name} as its model file describes it, with drives and friction by rules of thumb")}
robot = "{ROBOT}"         # beside this file

[plant]                      # what is true; drives that are not stated are those of {ROBOT}
payload = {toml_value(true)}
# {new.payload_source}
# kg, m in the frame of the last link, kg m^2 about the centre of mass

[experiment]
motion = "{MOTION}"       # found within the limits of {ROBOT}; rx90 excite finds a better one

[belief]                     # what controller and identification assume
controller_gain = {new.drives["gain"].value.tolist()!r}  # those of {ROBOT}
payload = {toml_value(believed)}  # as it is

[tolerance]
gain = {tolerance!r}  # relative; four predicted standard deviations, 2 % at least
identifiable = {toml_value([each <= SHOWN for each in predicted])}  # predicted standard deviations \
[%]: {percents(predicted)}; limit: {100.0 * SHOWN:g}

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


def write_new_robot(new: NewRobot, motion: FourierTrajectory, predicted: Sequence[float], folder: Path) -> None:
    """Write all files or none: each is complete before the first is moved to its place.

    Raises:
        OSError: If something cannot be written.
    """
    model = os.path.relpath(new.path.resolve(), folder.resolve())
    with TemporaryDirectory(dir=folder, prefix=".new-robot-") as staging:
        there = Path(staging)
        (there / ROBOT).write_text(new.text(model), encoding="utf-8")
        (there / SCENARIO).write_text(scenario_text(new, predicted), encoding="utf-8")
        write_motion(motion, there / MOTION, [MADE])
        for name in FILES:
            os.replace(there / name, folder / name)


def check_no_other_robot(folder: Path, model: Path) -> None:
    """Check that a folder has no robot of another model file.

    Raises:
        ScenarioError: If it does.
    """
    path = folder / ROBOT
    try:
        table = read_toml(path, error=ScenarioError)
    except ScenarioError:  # none, empty, or nothing of value
        return
    name, there = table.get("name"), table.get("model")
    if isinstance(there, str) and (folder / there).resolve() != model.resolve():
        raise ScenarioError(
            f"{path}: is of another robot, {shown(name)} from {shown(there)}; give another folder, or add --force"
        )
