"""Recordings of two weights and a file of gains, as commands that weigh and compare read them."""

import json
import tomllib
from pathlib import Path

import numpy as np
from quick import quick_scenario
from undiagnosed import undiagnosed

import rx90_mjcf
from scenarios.cli import main
from scenarios.results.gains_file import read_gains

TWO_WEIGHTS = """
[plant.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
[belief.payloads]
light = "4.275 kg"
heavy = "7.025 kg"
"""
MODEL = str(rx90_mjcf.MJCF)
PLAIN = ["--option", "friction=viscous-coulomb"]
"""Data need not choose what is known, which takes longer."""


def make_cell(folder: Path) -> Path:
    """Recordings bare, light and heavy in a folder, run.json with the run's gains, gains.toml from bare and heavy."""
    path = quick_scenario(folder, TWO_WEIGHTS, method="nls", lasts=7.0)
    text = path.read_text().replace(
        'motion = "short.toml"',
        'motion = "short.toml"\nprotocol = ["bare", "light", "heavy"]\ncontroller.bandwidth_hz = 8.0',
    )
    path.write_text(text)
    with undiagnosed():
        main(["run", str(path), "--save", str(folder / "run"), "--gains-out", str(folder / "run.json")])
        assert main([*identified(folder), *PLAIN, "--gains-out", str(folder / "gains.toml")]) == 0
    return folder


def identified(cell: Path) -> list[str]:
    run = cell / "run"
    return ["identify", "--model", MODEL, "--unloaded", str(run / "unloaded.parquet"),
            "--loaded", str(run / "heavy.parquet"), "--payload", str(run / "payload-heavy.toml")]  # fmt: skip


def light(cell: Path) -> list[str]:
    """Words that give the light motion, which the gains were not found from, to be predicted."""
    run = cell / "run"
    return ["--unseen", str(run / "light.parquet"), "--unseen-payload", str(run / "payload-light.toml")]


def with_other(words: list[str], option: str, value: str) -> list[str]:
    """Words of a command with another value of an option."""
    at = words.index(option) + 1
    return [*words[:at], value, *words[at + 1 :]]


def heavier(cell: Path, factor: float, folder: Path) -> str:
    """A copy of the light payload's file that states more mass than it has."""
    text = (cell / "run" / "payload-light.toml").read_text()
    mass = tomllib.loads(text)["mass"]
    path = folder / "heavier.toml"
    path.write_text(text.replace(f"mass = {mass}", f"mass = {factor * mass}"))
    return str(path)


def editable(path: Path) -> str:
    """The text of a gains file without its digest, which would refuse changes."""
    return "".join(line for line in path.read_text().splitlines(True) if not line.startswith("digest ="))


def off(cell: Path, joint: int, factor: float, name: str) -> None:
    """A copy of the gains with one of them off."""
    (cell / name).write_text(json.dumps(_scaled(cell, {joint: factor})))


def elsewhere(cell: Path, factor: float, path: Path) -> str:
    """A copy of the gains, all of them a factor too large, as if they were found from other motions."""
    path.write_text(json.dumps(_scaled(cell, dict.fromkeys(range(1, 7), factor)) | {"recordings": []}))
    return str(path)


def _scaled(cell: Path, factors: dict[int, float]) -> dict:
    """The file of gains with those of some joints, from 1, times a factor."""
    file = read_gains(cell / "gains.toml").model_dump(mode="json", exclude_none=True)
    found = [each for each in file["gains"] if each["identifiable"]]
    factor = np.array([factors.get(each["joint"], 1.0) for each in found])
    for each, times in zip(found, factor.tolist(), strict=True):
        each |= {key: times * each[key] for key in ("estimate", "std")}
    file["covariance"] = (np.outer(factor, factor) * file["covariance"]).tolist()
    return file
