"""A run as a folder, that of `--save`, and the command that identifies the same from it."""

import shlex
from dataclasses import asdict, fields
from pathlib import Path

from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.payload_files import write_payload
from ident.recording_files import write_recording
from scenarios.files.schema_line import schema_line
from scenarios.run import Run
from scenarios.store.documents import run_document, to_json

FILES = ("unloaded.parquet", "loaded.parquet", "payload.toml", "truth.json", "result.json")
"""What is written."""


def save_run(run: Run, folder: Path) -> None:
    """Write recordings, believed payload, truth and result.

    `identify_command` gives the same estimate on them, to the last digit.

    Raises:
        OSError: If the folder cannot be written.
    """
    for name, recording in zip(("unloaded", "loaded"), run.recordings, strict=True):
        write_recording(recording, folder / f"{name}.parquet")
    write_payload(run.bench.payload, folder / "payload.toml", comment=schema_line("payload"))
    plant = run.bench.experiments[0].plant
    truth = {
        "drives": {field.name: getattr(plant.drives, field.name).tolist() for field in fields(plant.drives)},
        "payload": asdict(plant.payload),
    }
    (folder / "truth.json").write_text(to_json(truth) + "\n", encoding="utf-8")
    (folder / "result.json").write_text(to_json(run_document(run)) + "\n", encoding="utf-8")


def identify_command(run: Run, folder: Path) -> str:
    """The command that gives the same estimate on the files of `save_run`, to the last digit."""
    chosen = run.bench.scenario.table.identification
    words = ["rx90", "identify", "--model", str(run.bench.experiments[0].plant.robot.model)]
    for name in ("unloaded", "loaded"):
        words += [f"--{name}", str(folder / f"{name}.parquet")]
    words += ["--payload", str(folder / "payload.toml"), "--method", chosen.method]
    for first, second in run.bench.scenario.table.belief.couplings:
        words += ["--coupling", str(first), str(second)]
    for options, defaults in ((chosen.observe, ObserveOptions()), (chosen.gains, GainOptions())):
        for field in fields(options):
            value = getattr(options, field.name)
            if value != getattr(defaults, field.name):
                words += [f"--{field.name.replace('_', '-')}", str(value)]
    for name, value in chosen.options.items():
        words += ["--option", f"{name}={value}"]
    return shlex.join(words)
