"""Recording of a scenario: its motion as files for a controller, and instructions with its numbers."""

import json
import math
import shlex
from collections.abc import Collection, Iterable, Iterator
from io import StringIO
from pathlib import Path

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.timing import slowest_hz
from ident.observation.observation import REGRESSOR_RATE
from ident.support.naming import one_line
from scenarios.experiments.scenario import Setup
from scenarios.experiments.schema import BARE, TURNS, in_turns
from scenarios.rendering.content import Cell, Heading, Line, Mood, Paragraph, Part, Report, column, table
from scenarios.rendering.result import ResultModel
from scenarios.rendering.wording import NONE
from scenarios.results.diagnoses import PLANNED_LOGS, horizon_fold
from scenarios.results.run_folder import identify_command, model_words, payload_file
from scenarios.support.errors import ScenarioError
from sim.feedforward_currents import States, of_motors

MOST = 1_000_000
"""Largest number of samples of a file."""
KEPT = "kept, as it may have measured values; without it, this command writes the scenario's payload"
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
    "Mount exactly what the files describe: hoses, sensors and grippers either are part of the payload or stay mounted "
    "for bare motions too.",
    "Log a minute at rest: positions must not drift, and each sample must be logged exactly once.",
    "Turn each joint by hand or slowly: the logged position must increase with that of the model's joint, or as "
    "q_motor = A q if motors turn several joints.",
)
SAFETY = (
    "This page does not replace the robot's manual or a risk assessment of your cell: the motion avoids only the arm's "
    "own model, not fences, tables, cables or hoses.",
    "Keep everybody out of reach while the robot moves; one person stays at the emergency stop.",
    "Run the motion bare at reduced speed first, then at full speed, then with each payload at reduced speed.",
    "Stop at collisions, protective stops or unusual noise; record a stopped motion again in full.",
)


def sampled(setup: Setup, rate_hz: float) -> States:
    """Return the motion of a scenario's motors at a rate [Hz], to its end: the last period may be shorter."""
    motion = setup.experiments[0].trajectory
    periods = math.ceil(motion.duration * rate_hz * (1.0 - 1e-9))  # of a whole number
    if not 1 <= periods <= MOST:
        said = f"{motion.duration:g} s at {rate_hz:g} Hz are {periods:g} samples; expected 1 to {MOST}"
        raise ScenarioError(f"{setup.scenario.name}: {said}")
    t = np.minimum(np.arange(periods + 1) / rate_hz, motion.duration)
    t[-1] = motion.duration
    return of_motors(States(t, *motion(t)), setup.plant.robot.motors)


def controller_files(setup: Setup, motion: States) -> dict[str, str]:
    """Return the motion as texts by name: CSV, ROS 2 `JointTrajectory`, and URScript for an arm with its joints."""
    arm, text = setup.structure.arm, StringIO()
    names = [f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, arm.n + 1)]
    comment = f"# s, rad, rad/s, rad/s^2 (m for prismatic joints); joints: {', '.join(arm.joint_names)}"
    header = f"{comment}\n{','.join(['t', *names])}"
    np.savetxt(text, np.column_stack(motion), fmt="%.17g", delimiter=",", header=header, comments="")
    ros = [f"joint_names: {json.dumps(arm.joint_names)}", "points:"]
    for t, q, dq, ddq in zip(*motion, strict=True):
        sec, nanosec = divmod(round(float(t) * 10**9), 10**9)
        ros += [f"- positions: {_row(q, 12)}", f"  velocities: {_row(dq, 12)}", f"  accelerations: {_row(ddq, 12)}"]
        ros.append(f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}")
    texts = {"motion.csv": text.getvalue(), "motion.yaml": "\n".join(ros) + "\n"}
    if arm.revolute.all() and arm.n == 6:  # slowly to the start, where vibrations decay; then with URScript's defaults
        ur = ["def drive_gains():", f"  movej({_row(motion.q[0], 9)}, a=0.3, v=0.2)", "  sleep(2.0)"]
        steps = zip(motion.q[1:], np.diff(motion.t), strict=True)
        ur += [f"  servoj({_row(q, 9)}, t={step:.9g}, lookahead_time=0.1, gain=300)" for q, step in steps]
        texts["motion.script"] = "\n".join([*ur, "  stopj(2.0)", "end", "drive_gains()"]) + "\n"
    return texts


def _row(values: Iterable[float], digits: int) -> str:
    """Return numbers without exponents: YAML reads 1e-05 as a string."""
    return "[" + ", ".join(f"{x:.{digits}f}" for x in values) + "]"


class RecordedJoint(ResultModel):
    """Motion of a joint; rad, or m for a prismatic one."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    name: str  # name of the joint in the model
    start: float  # first position [rad or m]
    lowest: float  # lowest position [rad or m]
    highest: float  # highest position [rad or m]
    max_velocity: float  # largest speed [rad/s or m/s]
    velocity_used: float  # largest speed relative to the limit of the joint
    max_acceleration: float  # largest acceleration [rad/s^2 or m/s^2]
    acceleration_used: float  # largest acceleration relative to the limit of the joint


class Recorded(ResultModel):
    """What `rx90 record --json` prints."""

    files: list[str]  # files that were written
    kept: list[str]  # payload files that were there, and may have measured values
    samples: int  # number of samples of the motion
    duration_s: float  # time from the first to the last sample [s]
    joints: list[RecordedJoint]  # one entry per joint, in order
    beyond_limits: list[str]  # limits of the arm that the motion exceeds, in words, one entry per joint and limit

    transmission: list[list[float]] | None = Field(
        description="Ratios A of motors that several joints turn: the motion is that of the motors, q_motor = A q"
    )

    @classmethod
    def of(cls, setup: Setup, motion: States) -> "Recorded":
        """Return the motion of a scenario with the limits that it uses; no files yet."""
        robot, arm = setup.plant.robot, setup.structure.arm
        lowest, highest = motion.q.min(axis=0), motion.q.max(axis=0)
        speed, acceleration = np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)
        used = speed / robot.drives.max_velocity, acceleration / robot.drives.max_acceleration
        columns = np.transpose((motion.q[0], lowest, highest, speed, used[0], acceleration, used[1])).tolist()
        rows = ((j, name, *row) for j, (name, row) in enumerate(zip(arm.joint_names, columns, strict=True), 1))
        joints = [RecordedJoint.model_validate(dict(zip(RecordedJoint.model_fields, row, strict=True))) for row in rows]
        outside = (lowest < arm.lower) | (highest > arm.upper)
        over = {"positions": outside, "speed": used[0] > 1.0, "acceleration": used[1] > 1.0}
        beyond = [f"joint {j + 1}: {what}" for j in range(arm.n) for what, beyond in over.items() if beyond[j]]
        A = None if arm.transmission is None else arm.transmission.tolist()
        n, end = len(motion.t), float(motion.t[-1])
        found = {"samples": n, "duration_s": end, "joints": joints, "beyond_limits": beyond, "transmission": A}
        return cls.model_validate({"files": [], "kept": [], **found})

    def motion(self) -> list[Part]:
        """Return the table of the motion, and the limits that it exceeds."""

        def share(value: float) -> Cell:
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
        if self.transmission is not None:
            words = f"This motion, also in the files, is that of the motors, q_motor = A q, A = {self.transmission}."
            parts.append(Paragraph(words))
        return [*parts, Paragraph("In rad, rad/s, rad/s^2; m for prismatic joints.")]

    def parts(self) -> Iterable[Part]:
        """Return the motion, limits that it exceeds, written and kept files."""
        yield Paragraph(f"{self.samples} samples, {self.duration_s:g} s.", strong=True)
        yield from self.motion()
        yield Paragraph("Move the robot slowly to the start above, and run the motion at low speed first.")
        yield from (Paragraph(one_line(f"{each}: written")) for each in self.files)
        yield from (Paragraph(one_line(f"{each}: {KEPT}")) for each in self.kept)


def instructions(setup: Setup, recorded: Recorded, name: str, expected: Diagnosed) -> Report:
    """Return the page of a scenario's motions and payloads; `name` is the scenario's on the command line."""
    chosen, robot, experiments = setup.scenario.table, setup.experiments[0].plant.robot, setup.experiments
    warm_up, load, observe = chosen.experiment.warm_up, robot.rated_load, chosen.identification.observe
    rated = "" if load is None else f" The arm is rated for {load:g} kg, everything mounted together."
    heavy = [each for each, payload in setup.payloads.items() if load is not None and payload.mass > load]
    rated += f" Above the rated load: {', '.join(heavy)}; check the manual for the permitted speed." if heavy else ""
    warming = f"Before the first one, repeat the motion with a bare flange for {warm_up:g} s to warm up drives and oil."
    if not warm_up:
        warming = "The scenario states no warm-up. Repeat the motion until its currents no longer change."
    turns = (
        "Keep this order: motions before and after another mounting show how much the gains drift."
        if in_turns(setup.protocol)
        else "A change of the gains between bare and loaded motions looks like other gains: the intervals allow for "
        f"it, and motions in the order {', '.join(TURNS)} measure it."
    )
    parts: list[Part] = [
        Heading("Command"),
        table(
            list(zip(setup.protocol, experiments, strict=True)),
            column("Motion", lambda row: row[1].earlier + 1),
            column("Mounted", lambda row: "nothing" if row[0] == BARE else row[0], words=True),
            column("Rest before [s]", lambda row: f"{row[1].pause:g}" if row[1].earlier else None),
            column("Lasts [s]", lambda row: f"{row[1].trajectory.duration:g}"),
            column("File", lambda row: f"{row[1].name}.parquet", words=True),
            title="Order of motions",
        ),
        Paragraph(f"{warming} {turns}"),
        *recorded.motion(),
        Paragraph(
            "For the controller: motion.csv, motion.yaml (ROS 2 JointTrajectory), and for six revolute joints "
            "motion.script (URScript). To look at the motion:"
        ),
        Line(shlex.join(["rx90", "view", name])),
        Heading("Mount"),
        table(
            setup.payloads.items(),
            column("Payload", lambda row: row[0], words=True),
            column("Mass [kg]", lambda row: _about([row[1].mass], [row[1].mass_std])),
            column("Centre [m]", lambda row: _about(row[1].com or (), row[1].com_std) or "not stated", words=True),
            column("Known", lambda row: row[1].known, words=True),
            column("File", lambda row: payload_file(row[0]), words=True),
        ),
        Paragraph(
            "In the frame of the last link, as the scenario states; ± is one standard deviation. The files are in "
            "the folder of this page; enter the measured values there." + rated
        ),
        Heading("Log"),
        Paragraph(
            f"Time, positions of the {'joints' if robot.transmission is None else 'motors'} and currents of the "
            f"drives, each motion from its start to its end, at {slowest_hz(observe):g} Hz or more. Rates above "
            f"{REGRESSOR_RATE * observe.cutoff_hz:g} Hz do not improve the result, as faster logs are averaged."
        ),
        Paragraph(
            "Positions and currents from one clock, unfiltered if possible. State the kind of current: measured or "
            "commanded, in A, or a torque with its constant."
        ),
        *horizon_fold(expected.excluded, expected.undetectable, PLANNED_LOGS),
        Heading("Check before"),
        *map(Paragraph, BEFORE),
        Heading("Safety"),
        *map(Paragraph, SAFETY),
        Heading("Afterwards"),
        *_afterwards(setup),
    ]
    return Report(f"Recording of {setup.scenario.name}, robot {robot.name}", tuple(parts), {})


def _about(values: Collection[float], std: Collection[float]) -> str:
    """Return numbers with their standard deviations, if there are any; empty without numbers."""
    spread = f" ± {', '.join(f'{x:g}' for x in std)}" if values and any(std) else ""
    return ", ".join(f"{x:g}" for x in values) + spread


def _afterwards(setup: Setup) -> Iterator[Part]:
    """Yield the commands for the logs; a check has the bare ones with those of one mounting."""
    (model, *believed), n = model_words(setup), setup.structure.arm.n
    logs: dict[str, list[str]] = {BARE: []}
    for name, each in zip(setup.protocol, setup.experiments, strict=True):
        logs.setdefault(name, []).append(f"{each.name}.parquet")
    bare, first = logs.pop(BARE), f"{setup.experiments[0].name}.parquet"
    checks = [[*bare, "--loaded", *each, "--payload", payload_file(name)] for name, each in logs.items()]

    def command(*words: str) -> Line:
        return Line(shlex.join(["rx90", *words]))

    yield Paragraph(
        f"A Parquet or CSV log with columns t [s], q1 .. q{n} [rad] and v1 .. v{n} [drive units] is used as it is. "
        "Convert any other log, with the names and units of its columns in place of these:"
    )
    columns = [f"q=pos_{{1..{n}}}[deg]", f"v=cur_{{1..{n}}}[mA]"]
    yield command("convert", "LOG", "--out", first, "--signal", "current", "--columns", "t=time[ms]", *columns)
    yield Paragraph("and so on for each motion; then:")
    for words in checks if bare and checks else [[f"{each.name}.parquet" for each in setup.experiments]]:
        yield command("check", model, *words, *believed)
    yield Line(identify_command(setup, Path()) + " --gains-out gains.toml")
    if bare:
        other = ["--unloaded", bare[0], "--loaded", "other.parquet", "--payload", "other.toml"]
        yield Paragraph("and, with one more motion with another known payload:")
        yield command("verify", "--model", model, *believed, "--gains", "gains.toml", *other)
