"""What `rx90 recipe` writes: a page for those who record, every number from the scenario."""

import shlex
from collections.abc import Collection
from pathlib import Path

from ident.observation import REGRESSOR_RATE, ObserveOptions
from ident.payload import Payload
from scenarios.build import Bench
from scenarios.files.mountings import BARE
from scenarios.reports.content import Column, Heading, Line, Paragraph, Part, Report, Table, cells
from scenarios.reports.trajectory import motion_table
from scenarios.store.run_folder import identify_command, model_words, payload_file
from scenarios.trajectory_source import scenario_source

MOTIONS = (
    Column(title="Motion"),
    Column(title="Mounted", words=True),
    Column(title="Rest before", unit="s"),
    Column(title="Lasts", unit="s"),
    Column(title="File", words=True),
)
WEIGHTS = (
    Column(title="Weight", words=True),
    Column(title="Mass", unit="kg"),
    Column(title="Centre", unit="m", words=True),
    Column(title="Of it known", words=True),
    Column(title="File", words=True),
)
SHOWN_HZ = 1000.0
"""Rate at which speeds of the motion are looked at."""
BEFORE = (
    "Weigh every payload on a scale and write mass and deviation into its file: its error goes into the gains in full.",
    "Bolt the payload so that it cannot turn or rattle; enter its mass and centre into the robot's own settings too.",
    "Mount exactly what the files describe: hoses, sensors and grippers count, or stay on for bare motions as well.",
    "Log a minute at rest: positions must not drift, and a log must have every sample once.",
    "Turn each joint by hand or slowly: the position that is logged must rise when the model's joint does.",
)
SAFETY = (
    "This page does not replace the robot's manual, nor an assessment of your cell: the motion knows a "
    "model of the arm at most, no fences, tables, cables or hoses.",
    "Nobody is within reach while the robot moves; one person has a hand on the emergency stop.",
    "Run the motion bare at reduced speed first, then at full speed, then with each weight at reduced speed.",
    "Stop at collisions, protective stops or unusual noise; a motion that was stopped is recorded again, all of it.",
)


def recipe_report(prepared: Bench, name: str, commands: Collection[str]) -> Report:
    """The page.

    Args:
        prepared: The scenario.
        name: As commands name it.
        commands: Names of those that there are.
    """
    source, table = scenario_source(prepared), prepared.scenario.table
    robot = prepared.experiments[0].plant.robot
    load = robot.rated_load
    rated = "" if load is None else f" The arm is rated for {load:g} kg, everything mounted together."
    heavy = [each for each, payload in prepared.payloads.items() if load is not None and payload.mass > load]
    rated += f" Beyond that: {', '.join(heavy)}; the manual says whether, and how fast." if heavy else ""
    parts: list[Part] = [
        Heading("Command"),
        _motions(prepared),
        Paragraph(_warm_up(table.experiment.warm_up)),
        motion_table(source.sampled(SHOWN_HZ), source.limits),
        Paragraph("Speeds and accelerations in rad and s; m where a joint slides. As a file for a controller:"),
        Line(shlex.join(["rx90", "trajectory", name, "--out", "motion.csv"])),
        Paragraph("or --out motion.yaml for ROS 2, motion.script for URScript. To look at it: "),
        Line(shlex.join(["rx90", "view", name])),
        Heading("Mount"),
        _weights(prepared),
        Paragraph(
            "In the frame of the last link, as the scenario believes; write what you measure into the files." + rated
        ),
        Heading("Log"),
        *_log(table.identification.observe),
        Heading("Check before"),
        *map(Paragraph, BEFORE),
        Heading("Safety"),
        *map(Paragraph, SAFETY),
        Heading("Afterwards"),
        *_afterwards(prepared, commands),
    ]
    return Report(f"Recording recipe: {prepared.scenario.name}, robot {robot.name}", tuple(parts), {})


def _motions(prepared: Bench) -> Table:
    rows = tuple(
        cells(
            str(number),
            "nothing" if carried == BARE else carried,
            f"{each.pause:g}" if number > 1 else "-",
            f"{each.trajectory.duration:g}",
            f"{each.name}.parquet",
        )
        for number, (carried, each) in enumerate(zip(prepared.protocol, prepared.experiments, strict=True), 1)
    )
    return Table(title="In this order", columns=MOTIONS, rows=rows)


def _warm_up(seconds: float) -> str:
    if seconds > 0.0:
        return f"Before the first one, repeat the motion with a bare flange for {seconds:g} s: drives and oil warm up."
    return (
        "The scenario states no warm-up. Drives and oil warm up all the same: repeat the motion until its currents no "
        "longer change; a bare motion at the end shows what drifted."
    )


def _weights(prepared: Bench) -> Table:
    rows = tuple(
        cells(name, _mass(payload), _centre(payload), payload.known, payload_file(name))
        for name, payload in prepared.payloads.items()
    )
    return Table(columns=WEIGHTS, rows=rows)


def _mass(payload: Payload) -> str:
    return f"{payload.mass:g}" + (f" +- {payload.mass_std:g}" if payload.mass_std else "")


def _centre(payload: Payload) -> str:
    return "not stated" if payload.com is None else ", ".join(f"{x:g}" for x in payload.com)


def _log(observe: ObserveOptions) -> list[Part]:
    highest = max(observe.cutoff_hz, observe.decimation_cutoff_hz)
    return [
        Paragraph(
            "Time, positions of the joints and currents of the drives, each motion from its start to its end, at more "
            f"than {2.0 * highest:g} Hz: identification filters at {highest:g} Hz. As good as any are "
            f"{REGRESSOR_RATE * observe.cutoff_hz:g} Hz; faster logs are averaged."
        ),
        Paragraph(
            "Positions and currents by one clock, as raw as they are to be had. Say which current it is: measured or "
            "commanded, in A, or as torque with its constant; never one with the weight taken out."
        ),
    ]


def _afterwards(prepared: Bench, commands: Collection[str]) -> list[Part]:
    files = [f"{each.name}.parquet" for each in prepared.experiments]
    first, (model, *believed) = files[0], model_words(prepared)
    parts: list[Part] = [
        Line(shlex.join(["rx90", "convert", "LOG", "--out", first, "--signal", "current"])),
        Paragraph("and so on for each motion; then:"),
    ]
    if "check" in commands:
        parts.append(Line(shlex.join(["rx90", "check", model, *files, *believed])))
    other = ["--loaded", "other.parquet", "--payload", "other.toml"]
    bare = next((file for file, carried in zip(files, prepared.protocol, strict=True) if carried == BARE), None)
    parts.append(Line(identify_command(prepared, Path()) + " --gains-out gains.toml"))
    if bare is not None:
        parts.append(Paragraph("and, with one more motion that carries another known weight:"))
        words = ["rx90", "verify", "--model", model, *believed, "--gains", "gains.toml", "--unloaded", bare, *other]
        parts.append(Line(shlex.join(words)))
    return parts
