"""Results as files: the JSON object of `--json`, and the folder of `--save`."""

import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path

from ident.estimate import GainEstimate, IdentifiedGain, RefusedGain
from ident.observation import ObserveOptions
from ident.options import GainOptions
from ident.payload_files import write_payload
from ident.recording_files import write_recording
from scenarios.run import Run


def run_document(run: Run) -> dict[str, object]:
    """The result of `rx90 run` as one JSON object."""
    return {
        "scenario": run.bench.scenario.name,
        "seed": run.seed,
        "passed": run.verdict.passed,
        "gains": [asdict(gain) for gain in run.verdict.gains],
        "payload": [],
        "fit": _fit(run.estimate),
        "timing": {"simulate_s": run.simulate_s, "identify_s": run.identify_s},
    }


def estimate_document(estimate: GainEstimate, identify_s: float) -> dict[str, object]:
    """The result of `rx90 identify` as one JSON object of the same form; what needs a truth is null."""
    gains = [
        {
            "joint": number,
            "true": None,
            "estimate": joint.value if isinstance(joint, IdentifiedGain) else None,
            "std": joint.std if isinstance(joint, IdentifiedGain) else None,
            "rel_error": None,
            "z": None,
            "tolerance": None,
            "identifiable": isinstance(joint, IdentifiedGain),
            "passed": None,
            "reason": joint.reason if isinstance(joint, RefusedGain) else None,
        }
        for number, joint in enumerate(estimate.joints, 1)
    ]
    return {
        "scenario": None,
        "seed": None,
        "passed": None,
        "gains": gains,
        "payload": [],
        "fit": _fit(estimate),
        "timing": {"simulate_s": None, "identify_s": identify_s},
    }


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite would be no JSON and is an error."""
    return json.dumps(document, indent=2, allow_nan=False)


def save_run(run: Run, folder: Path) -> None:
    """Write recordings, believed payload, truth and result.

    `identify_command` gives the same estimate on them, to the last digit.

    Raises:
        OSError: If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, recording in zip(("unloaded", "loaded"), run.recordings, strict=True):
        write_recording(recording, folder / f"{name}.parquet")
    write_payload(run.bench.payload, folder / "payload.toml")
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


def _fit(estimate: GainEstimate) -> dict[str, object]:
    return {
        "method": estimate.method,
        "rows": estimate.rows,
        "error_norm": estimate.error_norm,
        "rel_error_norm": estimate.rel_error_norm,
        "sigma": estimate.sigma,
    }
