"""Files of a designed payload: payload file, and a scenario with it."""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from ident.payload.files import payload_from_table, payload_to_table, write_payload
from ident.payload.payload import Payload
from ident.support.naming import one_line
from scenarios.design.payload_design import PayloadDesign
from scenarios.design.weights import MASS_STD
from scenarios.experiments.files.motions import write_motion
from scenarios.experiments.files.mountings import LOADED
from scenarios.experiments.files.tables import builtin_names
from scenarios.experiments.files.toml_text import schema_line, toml_value
from sim.trajectory import FourierTrajectory

PAYLOAD, SCENARIO, MOTION = "payload.toml", "scenario.toml", "motion.toml"
SIGMAS = 3.0
"""Smallest tolerance of the written scenario, in predicted standard deviations."""
DIGITS, NOTHING = 6, 1e-9
"""Significant digits of written numbers, and share of the largest number below which a number is zero."""


def write_payload_folder(design: PayloadDesign, scenario: str, motion: FourierTrajectory | None, folder: Path) -> None:
    """Write the payload file and a scenario with the payload, and its motion if it is new.

    Raises:
        OSError: If something cannot be written.
    """
    weight, last = design.best.weight, one_line(design.carrying.design.problem.structure.arm.joint_names[-1])
    comment = (
        f"{schema_line('payload')}\n"
        f"# {weight.shape}: {weight.stated} mm, {90 * weight.quarter} degrees about the flange's z; "
        f"{weight.density:g} kg/m^3.\n"
        f"# com: m from {last}, the last joint, in the axes of the link that it moves; the drawing has the axes of\n"
        "# the flange. inertia: kg m^2 about com, in the same axes as com.\n"
        "# Nominal values. Weigh the finished payload and enter its mass here; mass_std assumes a scale\n"
        f"# of {2e3 * MASS_STD:g} g at two sigma."
    )
    write_payload(as_written(design.best.payload), folder / PAYLOAD, comment=comment)
    write_scenario_file(design, scenario, folder / SCENARIO)
    if motion is not None:
        write_motion(motion, folder / MOTION, [f"Searched for {PAYLOAD}"])


def as_written(payload: Payload) -> Payload:
    """Return a payload with significant digits; negligible numbers are zero."""
    return payload_from_table({key: _short(value) for key, value in payload_to_table(payload).items()})


def _short(value: object) -> object:
    """Return a rounded value of a payload's table."""
    if isinstance(value, Mapping):
        return dict(zip(value, _digits(list(value.values())), strict=True))
    if isinstance(value, list):
        return _digits(value)
    return _digits([value])[0] if isinstance(value, float) else value


def _digits(values: Sequence[float]) -> list[float]:
    nothing = NOTHING * max(map(abs, values))
    return [float(f"{each:.{DIGITS}g}") if abs(each) > nothing else 0.0 for each in values]


def write_scenario_file(design: PayloadDesign, scenario: str, path: Path) -> None:
    """Write a scenario with the payload that requires every identifiable gain."""
    wanted, after, weight = design.scenario.table.tolerance.gain, design.after.deviations, design.best.weight
    gain = [max(given, math.ceil(100.0 * SIGMAS * std) / 100.0) for given, std in zip(wanted, after.noise, strict=True)]
    base = scenario if scenario in builtin_names() else os.path.relpath(Path(scenario).resolve(), path.parent.resolve())
    payload = payload_to_table(as_written(design.best.payload))
    place = "payload" if design.mounting == LOADED else f"payloads.{design.mounting}"
    stated = {key: f"{key} = {toml_value(value)}" for key, value in payload.items()}
    lines = [
        schema_line("scenario"),
        f"extends = {toml_value(base)}",
        f'description = "with the {weight.shape} that was designed for it"',
        "",
        *([] if design.again is None else ["[experiment]", f"motion = {toml_value(MOTION)}", ""]),
        f"[plant.{place}]",
        *(stated[key] for key in ("mass", "com", "inertia")),
        "",
        f"[belief.{place}]",
        *stated.values(),
        "",
        "[tolerance]",
        f"gain = {gain!r}",
        f"identifiable = [{', '.join(str(bool(each)).lower() for each in design.shows(after))}]",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
