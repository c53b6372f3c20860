import json
import tomllib
from pathlib import Path

import jsonschema
import pytest
from places import ROOT

import rx90_mjcf
from scenarios.files.json_schema import ENDING, FOLDER, schemas
from scenarios.files.tables import CATALOG

NAMES = ("scenario", "payload", "result", "answer", "problem")
SHIPPED = {name: json.loads((FOLDER / f"{name}{ENDING}").read_text()) for name in NAMES}
TOML = [(path, "scenario") for path in sorted(CATALOG.glob("*.toml"))]
TOML += [(path, "payload") for path in rx90_mjcf.PAYLOADS.values()]


def checked(value: object, name: str) -> None:
    jsonschema.Draft202012Validator(SHIPPED[name]).validate(value)


def test_the_shipped_schemas_are_those_that_would_be_generated():
    assert schemas() == SHIPPED  # if not: make schemas


@pytest.mark.parametrize("name", SHIPPED)
def test_a_schema_is_one(name):
    jsonschema.Draft202012Validator.check_schema(SHIPPED[name])


@pytest.mark.parametrize(("path", "name"), TOML, ids=lambda x: getattr(x, "name", x))
def test_a_shipped_file_fits_the_schema_that_its_first_line_names(path: Path, name: str):
    marker, place = path.read_text().splitlines()[0].split(" ")
    assert marker == "#:schema"
    assert (path.parent / place).resolve() == FOLDER / f"{name}{ENDING}"
    checked(tomllib.loads(path.read_text()), name)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("scenario", 'extends = "nominal"\n[plant]\ngian = [1]'),
        ("scenario", 'extends = "nominal"\n[experiment]\nstep = "fast"'),
        ("scenario", 'extends = "nominal"\n[plant.errors]\nstribek = 0.1'),
        ("scenario", '[random.it]\ndistribution = "norm"'),
        ("payload", "mass_std = 0.1"),
        ("payload", "mass = -1.0"),
        ("payload", "mass = 1.0\nmas_std = 0.1"),
        ("payload", "mass = 1.0\ncom = [0.1, 0.2]"),
    ],
)
def test_a_wrong_file_does_not_fit(name, text):
    with pytest.raises(jsonschema.ValidationError):
        checked(tomllib.loads(text), name)


def test_the_result_of_a_run_fits_its_schema(tmp_path, capsys):
    from scenarios.cli import main

    main(["run", "nominal", "--seed", "3", "--save", str(tmp_path / "run"), "--json"])
    result = json.loads(capsys.readouterr().out)
    checked(result, "result")
    del result["gains"][2]["std"]
    with pytest.raises(jsonschema.ValidationError, match="'std' is a required property"):
        checked(result, "result")
    main(
        ["identify", "--model", str(rx90_mjcf.MJCF), "--json"]
        + [w for n in ("unloaded", "loaded") for w in (f"--{n}", str(tmp_path / "run" / f"{n}.parquet"))]
        + ["--payload", str(tmp_path / "run" / "payload.toml")]
    )
    checked(json.loads(capsys.readouterr().out), "result")
    checked(tomllib.loads((tmp_path / "run" / "payload.toml").read_text()), "payload")


def test_schemas_are_part_of_the_package():
    assert FOLDER == ROOT / "scenarios" / "schemas"
