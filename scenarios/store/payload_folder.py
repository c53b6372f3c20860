"""A designed payload as files: payload file, and a scenario that mounts it."""

import math
import os
from pathlib import Path

from ident.payload_files import payload_to_table, write_payload
from scenarios.design.payload_design import PayloadDesign
from scenarios.design.tolerances import MASS_STD
from scenarios.design.weights import SHAPES
from scenarios.files.motions import write_motion
from scenarios.files.mountings import LOADED
from scenarios.files.schema_line import schema_line
from scenarios.files.tables import builtin_names
from scenarios.files.toml_values import toml_value
from sim.trajectory import FourierTrajectory

PAYLOAD, SCENARIO, MOTION = "payload.toml", "scenario.toml", "motion.toml"
SIGMAS = 3.0
"""Predicted deviations that a tolerance of the written scenario leaves at least."""


def write_payload_folder(design: PayloadDesign, scenario: str, motion: FourierTrajectory | None, folder: Path) -> None:
    """Write the payload file and the scenario that mounts the payload, with its motion if it has one of its own.

    Args:
        design: The design.
        scenario: Name or path of the scenario that was designed for.
        motion: That was searched for the payload.
        folder: Where.

    Raises:
        OSError: If something cannot be written.
    """
    write_payload_file(design, folder / PAYLOAD)
    write_scenario_file(design, scenario, folder / SCENARIO)
    if motion is not None:
        write_motion(motion, folder / MOTION, [f"Searched for {PAYLOAD}"])


def write_payload_file(design: PayloadDesign, path: Path) -> None:
    """Write the payload file, to be corrected when the weight has been made and weighed."""
    weight = design.best.weight
    size = ", ".join(
        f"{each.name} {value:g}" for each, value in zip(SHAPES[weight.shape].dimensions, weight.dimensions, strict=True)
    )
    comment = (
        f"{schema_line('payload')}\n# {weight.shape}: {size} mm, {90 * weight.quarter} degrees about the flange's z; "
        f"{weight.density:g} kg/m^3.\n"
        f"# As drawn. Weigh it and write the mass here; mass_std is a scale's of {2e3 * MASS_STD:g} g at two sigma."
    )
    write_payload(design.best.payload, path, comment=comment)


def write_scenario_file(design: PayloadDesign, scenario: str, path: Path) -> None:
    """Write a scenario that mounts the payload and wants every gain that it shows.

    Args:
        design: The design.
        scenario: Name or path of the scenario that was designed for.
        path: Where.
    """
    table = design.scenario.table
    shown = design.shows(design.after.deviations)
    gain = [
        max(given, math.ceil(100.0 * SIGMAS * std) / 100.0)
        for given, std in zip(table.tolerance.gain, design.after.deviations.noise, strict=True)
    ]
    base = scenario if scenario in builtin_names() else os.path.relpath(Path(scenario).resolve(), path.parent.resolve())
    lines = [
        schema_line("scenario"),
        f"extends = {toml_value(base)}",
        f'description = "with the {design.best.weight.shape} that was designed for it"',
        "",
        *([] if design.again is None else ["[experiment]", f"motion = {toml_value(MOTION)}", ""]),
        *_payload_lines("plant", design, payload_to_table(design.best.payload)),
        "",
        *_payload_lines("belief", design, payload_to_table(design.best.payload)),
        "",
        "[tolerance]",
        f"gain = {gain!r}",
        f"identifiable = [{', '.join(str(bool(each)).lower() for each in shown)}]",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _payload_lines(side: str, design: PayloadDesign, table: dict[str, object]) -> list[str]:
    """The payload as a table of the plant or of the belief."""
    place = "payload" if design.mounting == LOADED else f"payloads.{design.mounting}"
    keys = ("mass", "com", "inertia") if side == "plant" else tuple(table)
    return [f"[{side}.{place}]", *(f"{key} = {toml_value(table[key])}" for key in keys)]
