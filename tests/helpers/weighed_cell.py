"""Recordings of two weights and a file of gains, as commands that weigh and compare read them."""

import json
from pathlib import Path

from quick import quick_scenario

import rx90_mjcf
from scenarios.cli import main
from scenarios.experiments.files.gains import read_gains

TWO_WEIGHTS = """
[experiment.controller]
bandwidth_hz = 8.0
[plant.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
[belief.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
"""
MODEL = str(rx90_mjcf.MJCF)


def make_cell(folder: Path) -> Path:
    """Recordings bare, light and heavy in a folder, and gains.toml from bare and heavy."""
    path = quick_scenario(folder, TWO_WEIGHTS, method="nls")
    text = path.read_text().replace(
        'motion = "short.toml"', 'motion = "short.toml"\nprotocol = ["bare", "light", "heavy"]'
    )
    path.write_text(text)
    main(["run", str(path), "--save", str(folder / "run")])
    words = [*identified(folder), "--gains-out", str(folder / "gains.toml")]
    words += ["--option", "friction=viscous-coulomb"]  # data need not choose what is known, which takes longer
    assert main(words) == 0
    return folder


def identified(cell: Path) -> list[str]:
    run = cell / "run"
    return ["identify", "--model", MODEL, "--unloaded", str(run / "unloaded.parquet"),
            "--loaded", str(run / "heavy.parquet"), "--payload", str(run / "payload-heavy.toml")]  # fmt: skip


def off(cell: Path, joint: int, factor: float, name: str) -> None:
    """A copy of the gains with one of them off."""
    file = read_gains(cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    at = [each["joint"] for each in file["gains"] if each["identifiable"]].index(joint)
    file["gains"][joint - 1]["estimate"] *= factor
    file["gains"][joint - 1]["std"] *= factor
    for k in range(len(file["covariance"])):
        file["covariance"][at][k] *= factor
        file["covariance"][k][at] *= factor
    (cell / name).write_text(json.dumps(file))
