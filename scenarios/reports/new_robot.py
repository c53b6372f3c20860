"""Report of `rx90 new-robot`: joints in order, assumed values, next commands."""

import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import scenarios.design.results as results
from ident.diagnosis.alternative import two_digits
from scenarios.design.excitation import near_words
from scenarios.design.new_robot import CLEAR, NewRobot
from scenarios.design.robot_folder import FILES, SCENARIO, Found
from scenarios.rendering.content import NONE, Line, Mood, Paragraph, Report, column, joints_named, percent, table
from sim.clearance import CLEARANCE


def new_robot_report(new: NewRobot, found: Found, folder: Path) -> Report:
    """Return the report: joints in order, limits with marks of assumed ones, next command."""
    torque, speed = new.drives["current_limit"], new.drives["max_velocity"]
    arm = new.arm
    units = [unit for unit, there in (("rad", arm.revolute.any()), ("m", not arm.revolute.all())) if there]
    place, rate = (", ".join(f"{unit}{per}" for unit in units) for per in ("", "/s"))
    effort = ", ".join({"rad": "N m", "m": "N"}[unit] for unit in units)
    joints = table(
        range(arm.n),
        column("Joint", lambda j: j + 1),
        column("Name", lambda j: arm.joint_names[j], words=True),
        column("Kind", lambda j: "revolute" if arm.revolute[j] else "prismatic", words=True),
        column(f"From [{place}]", lambda j: _end(arm.lower[j])),
        column(f"To [{place}]", lambda j: _end(arm.upper[j])),
        column(f"Torque [{effort}]", lambda j: f"{torque.value[j]:.4g}{_mark(torque.origin[j])}"),
        column(f"Speed [{rate}]", lambda j: f"{speed.value[j]:.4g}{_mark(speed.origin[j])}"),
        column("Predicted [%]", lambda j: percent(float(found.predicted[j]), ".2f")),
        column("Identifiable", lambda j: "yes" if found.identifiable[j] else "no", words=True),
    )
    load, said = new.load, list(_warnings(new))
    parts = (
        verdict(found),
        joints,
        Paragraph(
            "Check order and names of the joints against your controller's. Values marked * are assumed. Gains, "
            "friction, rotor inertias and payload are also assumed, by the rules of thumb noted in robot.toml. "
            "Predicted: standard deviation of the gain with the motion found, for residuals of 2 % of the "
            "torque."
        ),
        Paragraph(
            f"Payload: {load.body.mass:g} kg, centre {list(load.body.com)} m in the frame of the last link; "
            f"{load.source}."
        ),
        *([Paragraph(f"WARNING: payload: {load.warning}.", Mood.DOUBTFUL)] if load.warning else []),
        *map(Paragraph, said),
        Paragraph(f"{', '.join(FILES)} in {folder}. Next:"),
        Line(f"rx90 run {shlex.quote(str(folder / SCENARIO))}"),
    )
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
    return Report(f"Robot {new.name}: {arm.n} joints", parts, result.model_dump(mode="json"))


def verdict(found: Found) -> Paragraph:
    """Return the number of gains that motion and payload identify, their accuracy, and the joints without a gain."""
    sizes = [100.0 * std for std, ok in zip(found.predicted.tolist(), found.identifiable, strict=True) if ok]
    none = [j for j, ok in enumerate(found.identifiable, 1) if not ok]
    if not sizes:
        return Paragraph("No gain is identifiable with this motion and payload.", Mood.BAD, strong=True)
    size = " to ".join(dict.fromkeys(two_digits(each) for each in (min(sizes), max(sizes))))
    but = f", not of {joints_named(none)}" if none else ""
    said = (
        f"{len(sizes)} of {len(found.identifiable)} gains are identifiable{but}; predicted standard deviation {size} %."
    )
    return Paragraph(said, Mood.DOUBTFUL if none else Mood.GOOD, strong=True)


def _warnings(new: NewRobot) -> Iterator[str]:
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
            f"stability. Friction and rotor inertias in robot.toml follow rules of thumb; replace "
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


def _end(limit: float) -> str:
    return f"{limit:.4g}" if np.isfinite(limit) else NONE


def _mark(origin: str) -> str:
    return "*" if origin == "assumed" else ""
