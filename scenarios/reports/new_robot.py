"""What `rx90 new-robot` says: joints in order, what is assumed, what to do next."""

import shlex
from pathlib import Path

import numpy as np

import scenarios.design.results as results
from scenarios.design.excitation import near_words
from scenarios.design.new_robot import CLEAR, Found, NewRobot
from scenarios.design.robot_folder import FILES, SCENARIO
from scenarios.reports.content import NONE, Column, Line, Paragraph, Part, Report, Table, cells, percent
from sim.clearance import CLEARANCE

COLUMNS = (
    Column(title="Joint"),
    Column(title="Name", words=True),
    Column(title="Kind", words=True),
    Column(title="From", unit="rad, m"),
    Column(title="To", unit="rad, m"),
    Column(title="Torque", unit="N m, N"),
    Column(title="Speed", unit="rad/s, m/s"),
    Column(title="Predicted", unit="%"),
    Column(title="Wanted", words=True),
)


def new_robot_report(new: NewRobot, found: Found, folder: Path) -> Report:
    """The joints in their order, limits with what is assumed of them, and the command that comes next."""
    torque, speed = new.drives["current_limit"], new.drives["max_velocity"]
    arm = new.arm
    rows = tuple(
        cells(
            str(j + 1),
            arm.joint_names[j],
            "turns" if arm.revolute[j] else "slides",
            _end(arm.lower[j]),
            _end(arm.upper[j]),
            f"{torque.value[j]:.4g}{_mark(torque.origin[j])}",
            f"{speed.value[j]:.4g}{_mark(speed.origin[j])}",
            percent(float(found.predicted[j]), ".2g"),
            "yes" if found.identifiable[j] else "no",
        )
        for j in range(arm.n)
    )
    load = new.load
    parts: list[Part] = [
        Table(columns=COLUMNS, rows=rows),
        Paragraph(
            "Check order and names of the joints against your controller's. Values marked * are assumed; so "
            "are gains, friction, rotor inertias and payload, by the rules of thumb noted in robot.toml. "
            "Predicted: standard deviation of the gain with the motion found, for residuals of 2 % of the "
            "torque."
        ),
        Paragraph(
            f"Payload: {load.body.mass:g} kg, centre {list(load.body.com)} m in the frame of the last link; "
            f"{load.source}."
        ),
    ]
    if load.warning:
        parts.append(Paragraph(f"Warning: payload: {load.warning}."))
    if new.end.held:
        parts.append(
            Paragraph(
                f"Taken for a gripper's and held: {', '.join(new.end.held)}. The arm ends at body {new.end.flange}, "
                "which carries the payload; name another last body with --flange."
            )
        )
    if new.home_clearance < CLEAR:
        parts.append(
            Paragraph(f"Home {near_words(new.home_clearance)} floor or arm; give a pose clear of both with --home.")
        )
    if new.always_near:
        pairs = ", ".join(f"{one} and {other}" for one, other in new.always_near)
        parts.append(
            Paragraph(
                f"Within {1e3 * CLEARANCE:g} mm of each other at all positions, so their distance is not checked: "
                f"{pairs}."
            )
        )
    if new.facts.left:
        parts.append(
            Paragraph(
                f"The file's {', '.join(new.facts.left)} of joints are ignored, as they often serve numerical "
                "stability only. Friction and rotor inertias in robot.toml follow rules of thumb; replace "
                "them by measured values."
            )
        )
    if new.facts.from_shapes:
        parts.append(
            Paragraph(
                "The file states no inertia of these links, so it is computed from their shapes: "
                f"{', '.join(new.facts.from_shapes)}."
            )
        )
    if new.facts.missing_meshes:
        missing = new.facts.missing_meshes
        parts.append(
            Paragraph(
                f"{len(missing)} meshes are missing or cannot be compiled (first: {missing[0]}); clearance is checked "
                "without them."
            )
        )
    parts += [
        Paragraph(f"{', '.join(FILES)} in {folder}. Next:"),
        Line(f"rx90 run {shlex.quote(str(folder / SCENARIO))}"),
    ]
    result = results.NewRobot(
        robot=new.name,
        joints=list(arm.joint_names),
        predicted_rel_std=found.predicted.tolist(),
        identifiable=list(found.identifiable),
        files=[str(folder / name) for name in FILES],
        held=list(new.end.held),
        payload_mass=load.body.mass,
        payload_source=load.source,
        payload_warning=load.warning or None,
    )
    return Report(f"Robot {new.name}: {arm.n} joints", tuple(parts), result.model_dump(mode="json"))


def _end(limit: float) -> str:
    return f"{limit:.4g}" if np.isfinite(limit) else NONE


def _mark(origin: str) -> str:
    return "*" if origin == "assumed" else ""
