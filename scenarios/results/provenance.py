"""Provenance of a result: assumptions, commands that repeat it, versions, digests."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ident.model.arm import Arm
from ident.payload.payload import Payload, read_payload
from scenarios.rendering.content import Heading, Line, Paragraph, Part, pairs_table
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import RecordFile


def assumed(record: RecordFile, given: Mapping[str, Payload], arm: Arm) -> list[Part]:
    """Return the assumptions of a result: arm, payloads, options."""
    method = (
        {} if record.method is None else {"method": ", ".join(filter(None, [record.method, _options(record.options)]))}
    )
    rows = method | {
        "arm": f"{arm.name}: {arm.n} joints, kinematics from the model file; its inertias are not used",
        "coupled motors": _couplings(record.robot.couplings),
        **{f"payload {name}": _payload(payload) for name, payload in given.items()},
        "filters and rows": _options(record.observe),
        "limits for accepting a gain": _options(record.gains),
    }
    return [Heading("What was assumed"), pairs_table("What", "Value", rows)]


def payloads(record: RecordFile, given: GivenProblem) -> dict[str, Payload]:
    """Return payloads of a problem by the names of their files."""
    pairs = zip(record.motions, given.motions, strict=True)
    return {stated.payload: each.payload for stated, each in pairs if stated.payload and each.payload is not None}


def origin(
    record: RecordFile, payloads: Mapping[str, Payload], arm: Arm, again: str, seed: int | None = None
) -> list[Part]:
    """Return the assumptions of a saved result, and how to repeat it; `again` is the command that uses its files."""
    made = {"Original command": record.command} if record.command else {}
    about = {
        "Made": record.created,
        **({} if seed is None else {"Seed": str(seed)}),
        "Recordings": ", ".join(record.sources),
        "Versions": versions_in_words(record.versions),
    }
    commands = {**made, "The same from these files": again}
    return [*assumed(record, payloads, arm), *repeated(commands, about, record.files)]


def asked(folder: Path, record: RecordFile) -> dict[str, Payload]:
    """Return the planned payload of bare motions or of a check, by the name of its file."""
    return {} if record.payload is None else {record.payload: read_payload(folder / record.payload)}


def repeated(commands: Mapping[str, str], about: Mapping[str, str], digests: Mapping[str, str]) -> list[Part]:
    """Return the commands, versions and digests that are needed to reproduce the numbers."""
    parts: list[Part] = [Heading("How to repeat it")]
    for what, command in commands.items():
        parts += [Paragraph(f"{what}:"), Line(command)]
    parts.append(pairs_table("What", "Value", about))
    if digests:
        parts.append(pairs_table("File", "SHA-256", digests, shown=0, rest=f"SHA-256 of {len(digests)} files"))
    return parts


def versions_in_words(versions: Mapping[str, object]) -> str:
    """Names with versions, on one line."""
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def _couplings(pairs: Sequence[tuple[int, int]]) -> str:
    said = [f"motor {second} turns by the sum of joints {first} and {second}" for first, second in pairs]
    return "; ".join(said) or "none"


def _options(options: Mapping[str, object]) -> str:
    return ", ".join(f"{name} {value}" for name, value in options.items())


def mass(payload: Payload) -> str:
    """Return the specified mass and its standard deviation, in words."""
    known = f" ± {2e3 * payload.mass_std:.3g} g" if payload.mass_std else ""
    return f"{payload.mass:g} kg{known}"


def _payload(payload: Payload) -> str:
    used = {"all": "all values are used", "com": "mass and centre are used", "mass": "only the mass is used"}
    said = [f"{payload.mass:g} kg, sigma {payload.mass_std:g}"]
    if payload.com is not None:
        said.append(f"centre {_vector(payload.com)} m, sigma {_vector(payload.com_std)}")
    if payload.inertia is not None:
        said.append(f"inertia {_vector(payload.inertia)} kg m^2, sigma {_vector(payload.inertia_std)}")
    return f"{'; '.join(said)}; {used.get(payload.known, 'none of these is used')}"


def _vector(values: Sequence[float]) -> str:
    return f"({', '.join(f'{x:g}' for x in np.asarray(values).tolist())})"
