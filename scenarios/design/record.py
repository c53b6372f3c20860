"""Instructions for recording a scenario, with its numbers, and the result of `rx90 record`."""

import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.timing import slowest_hz
from ident.observation.observation import REGRESSOR_RATE
from ident.payload.payload import Payload
from ident.support.naming import one_line
from scenarios.design.controller_files import SampledMotion
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import BARE
from scenarios.rendering.content import NONE, Cell, Heading, Line, Mood, Paragraph, Part, Report, Table, column, table
from scenarios.rendering.result import ResultModel
from scenarios.results.diagnoses import horizon_paragraphs
from scenarios.results.run_folder import identify_command, model_words, payload_file

KEPT = "kept, but it differs from the scenario's payload; delete it and repeat the command, unless it was measured"
"""Remark on an existing payload file."""
SETTINGS = (
    "Set the mounted payload in the controller, as its manual requires. Motor currents, measured or commanded, remain "
    "valid with any feedforward. Never log a current from which the controller has subtracted the payload."
)
"""Advice on payload settings of the robot: u = K i holds for the motor current in any case."""
BEFORE = (
    "Weigh every payload and write mass and standard deviation into its file: a relative error of the mass is the "
    "same error of the gains.",
    "Bolt the payload so that it cannot turn or rattle.",
    SETTINGS,
    (
        "Mount exactly what the files describe: hoses, sensors and grippers either are part of the payload or stay "
        "mounted for bare motions too."
    ),
    "Log a minute at rest: positions must not drift, and each sample must be logged exactly once.",
    "Turn each joint by hand or slowly: the logged position must increase with that of the model's joint.",
)
SAFETY = (
    (
        "This page does not replace the robot's manual or a risk assessment of your cell: the motion "
        "avoids only the arm's own model, not fences, tables, cables or hoses."
    ),
    "Keep everybody out of reach while the robot moves; one person stays at the emergency stop.",
    "Run the motion bare at reduced speed first, then at full speed, then with each payload at reduced speed.",
    "Stop at collisions, protective stops or unusual noise; record a stopped motion again in full.",
)


class RecordedJoint(ResultModel):
    """Motion of a joint; rad, or m for a prismatic one."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    name: str = Field(description="Name of the joint in the model")
    start: float = Field(description="First position [rad or m]")
    lowest: float = Field(description="Lowest position [rad or m]")
    highest: float = Field(description="Highest position [rad or m]")
    max_velocity: float = Field(description="Largest speed [rad/s or m/s]")
    velocity_used: float = Field(description="Largest speed relative to the limit of the joint")
    max_acceleration: float = Field(description="Largest acceleration [rad/s^2 or m/s^2]")
    acceleration_used: float = Field(description="Largest acceleration relative to the limit of the joint")


class Recorded(ResultModel):
    """What `rx90 record --json` prints."""

    files: list[str] = Field(description="Files that were written")
    kept: list[str] = Field(description="Existing payload files that differ from the scenario's payloads")
    samples: int = Field(description="Number of samples of the motion")
    duration_s: float = Field(description="Time from the first to the last sample [s]")
    joints: list[RecordedJoint] = Field(description="One entry per joint, in order")
    beyond_limits: list[str] = Field(
        description="Limits of the arm that the motion exceeds, in words, one entry per joint and limit"
    )

    @classmethod
    def of(cls, setup: Setup, motion: SampledMotion) -> "Recorded":
        """Return the motion of a scenario with the limits that it uses; no files yet."""
        robot, arm = setup.plant.robot, setup.structure.arm
        speed, acceleration = np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)
        lowest, highest = motion.q.min(axis=0), motion.q.max(axis=0)
        joints = [
            RecordedJoint(
                joint=j + 1,
                name=name,
                start=float(motion.q[0, j]),
                lowest=float(lowest[j]),
                highest=float(highest[j]),
                max_velocity=float(speed[j]),
                velocity_used=float(speed[j] / robot.max_velocity[j]),
                max_acceleration=float(acceleration[j]),
                acceleration_used=float(acceleration[j] / robot.max_acceleration[j]),
            )
            for j, name in enumerate(motion.joint_names)
        ]
        outside = (lowest < arm.lower) | (highest > arm.upper)
        beyond = [
            f"joint {each.joint}: {what}"
            for each in joints
            for what, over in (
                ("positions", outside[each.joint - 1]),
                ("speed", each.velocity_used > 1.0),
                ("acceleration", each.acceleration_used > 1.0),
            )
            if over
        ]
        return cls(
            files=[],
            kept=[],
            samples=len(motion.t),
            duration_s=float(motion.t[-1]),
            joints=joints,
            beyond_limits=beyond,
        )

    def motion(self) -> list[Part]:
        """Return the table of the motion, and the limits that it exceeds."""

        def share(value: float) -> Cell:
            """Return a share of a limit in percent, a dash without a limit."""
            return Cell(f"{100.0 * value:.0f}", Mood.BAD if value > 1.0 else Mood.PLAIN) if value else Cell(NONE)

        parts: list[Part] = [
            table(
                self.joints,
                column("Joint", lambda each: each.joint),
                column("Name", lambda each: each.name, words=True),
                column("Start", lambda each: f"{each.start:.4f}"),
                column("Lowest", lambda each: f"{each.lowest:.4f}"),
                column("Highest", lambda each: f"{each.highest:.4f}"),
                column("Speed", lambda each: f"{each.max_velocity:.3f}"),
                column("Of limit [%]", lambda each: share(each.velocity_used)),
                column("Acceleration", lambda each: f"{each.max_acceleration:.3f}"),
                column("Of limit [%]", lambda each: share(each.acceleration_used)),
            )
        ]
        if self.beyond_limits:
            words = f"Beyond the robot's limits: {', '.join(self.beyond_limits)}."
            parts.append(Paragraph(words, Mood.BAD, strong=True))
        return [*parts, Paragraph("In rad, rad/s, rad/s^2; m for prismatic joints.")]

    def parts(self) -> Iterable[Part]:
        """Return the motion, limits that it exceeds, written and kept files."""
        yield Paragraph(f"{self.samples} samples, {self.duration_s:g} s.", strong=True)
        yield from self.motion()
        yield Paragraph("Move the robot slowly to the start above, and run the motion at low speed first.")
        yield from (Paragraph(one_line(f"{each}: written")) for each in self.files)
        yield from (Paragraph(one_line(f"{each}: {KEPT}"), Mood.DOUBTFUL) for each in self.kept)


def instructions(
    setup: Setup,
    recorded: Recorded,
    payloads: Mapping[str, Payload],
    name: str,
    commands: Collection[str],
    expected: Diagnosed,
) -> Report:
    """Return the page of a scenario's motions and payloads; `name` is the scenario's on the command line."""
    chosen, robot = setup.scenario.table, setup.experiments[0].plant.robot
    load, observe = robot.rated_load, chosen.identification.observe
    rated = "" if load is None else f" The arm is rated for {load:g} kg, everything mounted together."
    heavy = [each for each, payload in payloads.items() if load is not None and payload.mass > load]
    rated += f" Above the rated load: {', '.join(heavy)}; check the manual for the permitted speed." if heavy else ""
    warm_up = chosen.experiment.warm_up
    warming = (
        "The scenario states no warm-up. Repeat the motion until its currents no longer change; a bare motion at the "
        "end shows the remaining drift."
    )
    if warm_up > 0.0:
        warming = (
            f"Before the first one, repeat the motion with a bare flange for {warm_up:g} s to warm up drives and oil."
        )
    parts: list[Part] = [
        Heading("Command"),
        _motions(setup),
        Paragraph(warming),
        *recorded.motion(),
        Paragraph(
            "For the controller: motion.csv, motion.yaml (ROS 2 JointTrajectory), and for six revolute joints "
            "motion.script (URScript). To look at the motion:"
        ),
        Line(shlex.join(["rx90", "view", name])),
        Heading("Mount"),
        _weights(payloads),
        Paragraph(
            "In the frame of the last link, as the scenario states; ± is one standard deviation. The files are in "
            "the folder of this page; enter the measured values there." + rated
        ),
        Heading("Log"),
        Paragraph(
            "Time, positions of the joints and currents of the drives, each motion from its start to its end, "
            f"at {slowest_hz(observe):g} Hz or more. Rates above {REGRESSOR_RATE * observe.cutoff_hz:g} Hz do not "
            "improve the result, as faster logs are averaged."
        ),
        Paragraph(
            "Positions and currents from one clock, unfiltered if possible. State the kind of current: measured or "
            "commanded, in A, or a torque with its constant."
        ),
        *horizon_paragraphs(expected, every=True, expected=True),
        Heading("Check before"),
        *map(Paragraph, BEFORE),
        Heading("Safety"),
        *map(Paragraph, SAFETY),
        Heading("Afterwards"),
        *_afterwards(setup, commands),
    ]
    return Report(f"Recording of {setup.scenario.name}, robot {robot.name}", tuple(parts), {})


def _motions(setup: Setup) -> Table:
    return table(
        list(enumerate(zip(setup.protocol, setup.experiments, strict=True), 1)),
        column("Motion", lambda row: row[0]),
        column("Mounted", lambda row: "nothing" if row[1][0] == BARE else row[1][0], words=True),
        column("Rest before [s]", lambda row: f"{row[1][1].pause:g}" if row[0] > 1 else None),
        column("Lasts [s]", lambda row: f"{row[1][1].trajectory.duration:g}"),
        column("File", lambda row: f"{row[1][1].name}.parquet", words=True),
        title="Order of motions",
    )


def _weights(payloads: Mapping[str, Payload]) -> Table:
    def mass(payload: Payload) -> str:
        return f"{payload.mass:g}" + (f" ± {payload.mass_std:g}" if payload.mass_std else "")

    def centre(payload: Payload) -> str:
        if payload.com is None:
            return "not stated"
        spread = f" ± {', '.join(f'{x:g}' for x in payload.com_std)}" if any(payload.com_std) else ""
        return ", ".join(f"{x:g}" for x in payload.com) + spread

    return table(
        payloads.items(),
        column("Payload", lambda row: row[0], words=True),
        column("Mass [kg]", lambda row: mass(row[1])),
        column("Centre [m]", lambda row: centre(row[1]), words=True),
        column("Known", lambda row: row[1].known, words=True),
        column("File", lambda row: payload_file(row[0]), words=True),
    )


def _checked(setup: Setup, files: Sequence[str]) -> list[list[str]]:
    """Return the recordings of each check: bare ones with those of one mounting."""
    bare = [file for file, carried in zip(files, setup.protocol, strict=True) if carried == BARE]
    loaded = dict[str, list[str]]()
    for file, carried in zip(files, setup.protocol, strict=True):
        if carried != BARE:
            loaded.setdefault(carried, []).append(file)
    if not bare or not loaded:
        return [list(files)]
    return [[*bare, "--loaded", *each, "--payload", payload_file(name)] for name, each in loaded.items()]


def _afterwards(setup: Setup, commands: Collection[str]) -> list[Part]:
    files = [f"{each.name}.parquet" for each in setup.experiments]
    first, (model, *believed) = files[0], model_words(setup)
    n = setup.experiments[0].plant.robot.n
    columns = ["t=time[ms]", f"q=pos_{{1..{n}}}[deg]", f"v=cur_{{1..{n}}}[mA]"]
    parts: list[Part] = [
        Paragraph(
            f"A Parquet or CSV log with columns t [s], q1 .. q{n} [rad] and v1 .. v{n} [drive units] is used as it is. "
            "Convert any other log, with the names and units of its columns in place of these:"
        ),
        Line(shlex.join(["rx90", "convert", "LOG", "--out", first, "--signal", "current", "--columns", *columns])),
        Paragraph("and so on for each motion; then:"),
    ]
    if "check" in commands:
        parts += [Line(shlex.join(["rx90", "check", model, *words, *believed])) for words in _checked(setup, files)]
    other = ["--loaded", "other.parquet", "--payload", "other.toml"]
    bare = next((file for file, carried in zip(files, setup.protocol, strict=True) if carried == BARE), None)
    parts.append(Line(identify_command(setup, Path()) + " --gains-out gains.toml"))
    if bare is not None:
        parts.append(Paragraph("and, with one more motion with another known payload:"))
        words = ["rx90", "verify", "--model", model, *believed, "--gains", "gains.toml", "--unloaded", bare, *other]
        parts.append(Line(shlex.join(words)))
    return parts
