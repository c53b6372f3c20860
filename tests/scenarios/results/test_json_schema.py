import json
import re
import tomllib
from functools import cache
from typing import Any
from urllib.request import urlopen
from zipfile import ZipFile

import jsonschema
import pytest
from hatchling.build import build_wheel
from places import ROOT
from plants import short_motion
from printed import fits

import rx90_mjcf
from scenarios.experiments.motions import write_motion
from scenarios.experiments.robots import robot_file
from scenarios.experiments.scenario_files import BUILT_IN, CATALOG
from scenarios.results.json_schemas import FILES, RESULTS, schema
from scenarios.support.texts import ENDING, FOLDER

PRINTED = ("answer", "gains", *RESULTS)
made = cache(schema)
UNIT = re.compile(r"\[[^\]`]+\]|in (products of )?`unit`|in the unit that `measure` names")
"""How a description states a unit, or the key that does."""
DIMENSIONLESS = re.compile(r"relative|share|probability|deviations|ratio|sum of the squared|logarithm|standard errors")
TOML = [(path, "scenario") for path in sorted(CATALOG.glob("*.toml"))]
TOML += [(path, "payload") for path in rx90_mjcf.PAYLOADS.values()]
TOML += [(path, "motion") for path in sorted(CATALOG.glob("motions/*.toml"))]
TOML += [(path, "robot") for path in map(robot_file, BUILT_IN["robot"])]


def test_the_shipped_schemas_are_those_that_are_generated():
    shipped = {path.name.removesuffix(ENDING): json.loads(path.read_text()) for path in FOLDER.iterdir()}
    assert shipped == {name: made(name) for name in FILES}  # if not: make schemas


def numbers(value: dict[str, Any]) -> bool:
    """Whether a key's value may be a number, or rows of numbers."""
    inner = [value["items"]] if "items" in value else value.get("anyOf", [])
    return value.get("type") == "number" or any(map(numbers, inner))


@pytest.mark.parametrize("name", FILES | RESULTS)
def test_a_schema_describes_every_key_and_the_unit_of_every_printed_number(name):
    whole = made(name)
    jsonschema.Draft202012Validator.check_schema(whole)
    for table in (whole, *whole.get("$defs", {}).values()):
        assert "Attributes:" not in table.get("description", "")
        for key, value in table.get("properties", {}).items():
            said = value.get("description", "").strip()
            assert said, f"{table['title']}.{key}"
            if name in PRINTED and numbers(value):
                assert UNIT.search(said) or DIMENSIONLESS.search(said.lower()), f"{table['title']}.{key}: {said}"


def test_a_shipped_file_fits_the_schema_that_its_first_line_names():
    for path, name in TOML:
        marker, place = path.read_text().splitlines()[0].split(" ")
        assert marker == "#:schema"
        assert (path.parent / place).resolve() == FOLDER / f"{name}{ENDING}", path
        fits(tomllib.loads(path.read_text()), name)


def test_a_wrong_file_does_not_fit():
    motion = "center = [0.3]\nsine = [[0.1]]"
    for name, text in (
        ("scenario", 'extends = "nominal"\n[plant]\ngian = [1]'),
        ("scenario", '[random.it]\ndistribution = "norm"'),
        ("payload", "mass = 1.0\nmas_std = 0.1"),
        ("motion", f"duration = 4.0\n{motion}"),
        ("motion", f"duration = 601.0\n{motion}\ncosine = [[0.2]]"),
    ):
        with pytest.raises(jsonschema.ValidationError):
            fits(tomllib.loads(text), name)


def test_a_motion_that_is_written_fits_the_schema_that_it_names(tmp_path):
    path = tmp_path / "a motion.toml"
    write_motion(short_motion(6.5, 0.25), path, ["Found by: nobody"])
    marker, place = path.read_text().splitlines()[0].split(" ")
    assert marker == "#:schema"
    with urlopen(place) as schema:
        assert json.load(schema) == made("motion")
    fits(tomllib.loads(path.read_text()), "motion")


def test_an_installed_package_holds_the_schemas_and_every_other_file_that_it_reads(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    with ZipFile(tmp_path / build_wheel(str(tmp_path))) as wheel:
        held = {name: wheel.read(name) for name in wheel.namelist()}
    packages = [ROOT / name for name in ("rx90_mjcf", "ident", "sim", "scenarios")]
    files = [
        path
        for package in packages
        for ending in ("json", "toml", "xml", "urdf")
        for path in package.rglob(f"*.{ending}")
    ]
    assert {path.name for path in files} >= {"motion.schema.json", "drive-gains.toml", "robot.toml", "rx90.xml"}
    for path in files:
        assert held[path.relative_to(ROOT).as_posix()] == path.read_bytes()
