"""`rx90 record`: instructions for recording, with numbers from the scenario, and the files that were written."""

import shlex
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.samples.clock import slowest_hz
from ident.observation.observation import REGRESSOR_RATE, ObserveOptions
from ident.payload.payload import Payload
from ident.support.naming import one_line
from scenarios.design.controller_files import SampledMotion
from scenarios.design.results import Recorded
from scenarios.experiments.schema import BARE
from scenarios.experiments.setup import Setup
from scenarios.rendering.content import NONE, Cell, Heading, Line, Mood, Paragraph, Part, Report, Table, column, table
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


def instructions(
    setup: Setup,
    motion: SampledMotion,
    payloads: Mapping[str, Payload],
    name: str,
    commands: Collection[str],
    expected: Diagnosed,
) -> Report:
    """Return the page of a scenario's motions and payloads; `name` is the scenario's on the command line."""
    table = setup.scenario.table
    robot = setup.experiments[0].plant.robot
    load = robot.rated_load
    rated = "" if load is None else f" The arm is rated for {load:g} kg, everything mounted together."
    heavy = [each for each, payload in payloads.items() if load is not None and payload.mass > load]
    rated += f" Above the rated load: {', '.join(heavy)}; check the manual for the permitted speed." if heavy else ""
    parts: list[Part] = [
        Heading("Command"),
        _motions(setup),
        Paragraph(_warm_up(table.experiment.warm_up)),
        motion_table(motion),
        *_beyond(motion),
        Paragraph(
            "Speeds and accelerations in rad and s; m for prismatic joints. For the controller: motion.csv, "
            "motion.yaml (ROS 2 JointTrajectory), and for six revolute joints motion.script (URScript). "
            "To look at the motion:"
        ),
        Line(shlex.join(["rx90", "view", name])),
        Heading("Mount"),
        _weights(payloads),
        Paragraph(
            "In the frame of the last link, as the scenario states; ± is one standard deviation. The files are in "
            "the folder of this page; enter the measured values there." + rated
        ),
        Heading("Log"),
        *_log(table.identification.observe),
        *horizon_paragraphs(expected, every=True, expected=True),
        Heading("Check before"),
        *map(Paragraph, BEFORE),
        Heading("Safety"),
        *map(Paragraph, SAFETY),
        Heading("Afterwards"),
        *_afterwards(setup, commands),
    ]
    return Report(f"Recording of {setup.scenario.name}, robot {robot.name}", tuple(parts), {})


def record_report(title: str, motion: SampledMotion, files: Sequence[str], different: Sequence[str]) -> Report:
    """Return the report of the command: motion, limits that it exceeds, written and kept files."""
    parts: list[Part] = [
        Paragraph(f"{len(motion.t)} samples, {motion.t[-1]:g} s.", strong=True),
        motion_table(motion),
        *_beyond(motion),
        Paragraph("In rad, rad/s, rad/s^2; m for prismatic joints."),
        Paragraph("Move the robot slowly to the start above, and run the motion at low speed first."),
        *(Paragraph(one_line(f"{each}: written")) for each in files),
        *(Paragraph(one_line(f"{each}: {KEPT}"), Mood.DOUBTFUL) for each in different),
    ]
    result = Recorded(
        files=list(files),
        kept=list(different),
        samples=len(motion.t),
        duration_s=float(motion.t[-1]),
        start=motion.q[0].tolist(),
        max_velocity=np.abs(motion.dq).max(axis=0).tolist(),
        max_acceleration=np.abs(motion.ddq).max(axis=0).tolist(),
        beyond_limits=list(motion.beyond),
    )
    return Report(one_line(title), tuple(parts), result.model_dump(mode="json"))


def motion_table(motion: SampledMotion) -> Table:
    """Return a table of positions, speeds and accelerations, with shares of the limits."""
    speed, acceleration = np.abs(motion.dq).max(axis=0), np.abs(motion.ddq).max(axis=0)

    def share(value: float) -> Cell:
        """Return a share of a limit in percent, a dash without a limit."""
        return Cell(f"{100.0 * value:.0f}", Mood.BAD if value > 1.0 else Mood.PLAIN) if value else Cell(NONE)

    return table(
        range(len(speed)),
        column("Joint", lambda j: j + 1),
        column("Name", lambda j: motion.joint_names[j], words=True),
        column("Start", lambda j: f"{motion.q[0, j]:.4f}"),
        column("Lowest", lambda j: f"{motion.q[:, j].min():.4f}"),
        column("Highest", lambda j: f"{motion.q[:, j].max():.4f}"),
        column("Speed", lambda j: f"{speed[j]:.3f}"),
        column("Of limit [%]", lambda j: share(motion.speed_used[j])),
        column("Acceleration", lambda j: f"{acceleration[j]:.3f}"),
        column("Of limit [%]", lambda j: share(motion.acceleration_used[j])),
    )


def _beyond(motion: SampledMotion) -> list[Paragraph]:
    if not motion.beyond:
        return []
    return [Paragraph(f"Beyond the robot's limits: {', '.join(motion.beyond)}.", Mood.BAD, strong=True)]


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


def _warm_up(seconds: float) -> str:
    if seconds > 0.0:
        return (
            f"Before the first one, repeat the motion with a bare flange for {seconds:g} s to warm up drives and oil."
        )
    return (
        "The scenario states no warm-up. Repeat the motion until its currents no longer change; a bare motion at the "
        "end shows the remaining drift."
    )


def _weights(payloads: Mapping[str, Payload]) -> Table:
    return table(
        payloads.items(),
        column("Payload", lambda row: row[0], words=True),
        column("Mass [kg]", lambda row: _mass(row[1])),
        column("Centre [m]", lambda row: _centre(row[1]), words=True),
        column("Known", lambda row: row[1].known, words=True),
        column("File", lambda row: payload_file(row[0]), words=True),
    )


def _mass(payload: Payload) -> str:
    return f"{payload.mass:g}" + (f" ± {payload.mass_std:g}" if payload.mass_std else "")


def _centre(payload: Payload) -> str:
    if payload.com is None:
        return "not stated"
    spread = f" ± {', '.join(f'{x:g}' for x in payload.com_std)}" if any(payload.com_std) else ""
    return ", ".join(f"{x:g}" for x in payload.com) + spread


def _log(observe: ObserveOptions) -> list[Part]:
    return [
        Paragraph(
            "Time, positions of the joints and currents of the drives, each motion from its start to its end, "
            f"at {slowest_hz(observe):g} Hz or more. Rates above {REGRESSOR_RATE * observe.cutoff_hz:g} Hz do not "
            "improve the result, as faster logs are averaged."
        ),
        Paragraph(
            "Positions and currents from one clock, unfiltered if possible. State the kind of current: measured or "
            "commanded, in A, or a torque with its constant."
        ),
    ]


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
