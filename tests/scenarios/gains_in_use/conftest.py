"""Files beside the weighed cell: gains that are off, and a copy of its model to patch."""

import json
import shutil
import tomllib
from pathlib import Path

import pytest
from bare_documents import bare_document
from weighed_cell import MODEL, light, off

from scenarios.results.gains_file import read_gains


@pytest.fixture
def sheet(weighed_cell) -> str:
    """Gains that are off up and down."""
    off(weighed_cell, 3, 1.2, "sheet.json")
    return str(weighed_cell / "sheet.json")


@pytest.fixture
def patching(weighed_cell, tmp_path) -> list[str]:
    """Words that write a copy of the model; and what bare motions say of friction, as it is."""
    shutil.copy(MODEL, tmp_path / "arm.xml")
    gains = read_gains(weighed_cell / "gains.toml").gains
    drives = tomllib.loads((Path(MODEL).parent / "robot.toml").read_text())["drives"]

    def friction(name: str, key: str, j: int) -> dict[str, object]:
        return {"parameter": name, "estimate": drives[key]["value"][j] / (gains[j].estimate or 1.0), "std": 0.01}

    both = {"Fv": "viscous_friction", "Fc": "coulomb_friction"}
    joints = [
        {"joint": j + 1, "name": each.name, "friction": [friction(name, key, j) for name, key in both.items()]}
        for j, each in enumerate(gains)
    ]
    (tmp_path / "bare.json").write_text(json.dumps(bare_document(1, joints, [])))
    files = ["--gains", str(weighed_cell / "gains.toml"), "--out", str(tmp_path / "patched.xml")]
    return ["patch", str(tmp_path / "arm.xml"), *files, *light(weighed_cell), "--json"]
