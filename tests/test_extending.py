import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from one_process import Outcome, carried_out
from places import ROOT
from quick import BRIEF, quick_scenario
from recipes import PACKAGES, RECIPES, follow

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from scenarios import load
from scenarios.__main__ import ONE_THREAD
from scenarios.experiments.run import Run
from scenarios.results.run_folder import save_run

GAIN = np.array([0.9401, 0.9619, 1.1148, 0.9146, 1.0, 1.0])
"""Injected gains: published ones of the paper's table 3, and two that are assumed."""
MORE = {"late": "rx90 check arm.xml late.parquet", "help": "rx90"}


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Run:
    path = quick_scenario(tmp_path_factory.mktemp("quick"), lasts=BRIEF)
    path.write_text(path.read_text().replace("step = 0.002\ncontroller.rate_hz = 500.0\n", ""))  # as `nominal` has them
    return load(str(path)).run()


@pytest.fixture(scope="module")
def followed(plain, tmp_path_factory) -> tuple[Path, Path]:
    """Packages that were changed as recipes say, and a folder with what a user has: logs, payload, model."""
    packages, work = tmp_path_factory.mktemp("packages"), tmp_path_factory.mktemp("work")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, packages / name)
    save_run(plain, work)
    for old, new in (("unloaded", "bare"), ("loaded", "heavy")):
        log = read_recording((work / f"{old}.parquet").rename(work / f"{new}.parquet"))
        columns = {"t": log.t} | {f"{x}{j + 1}": getattr(log, x)[:, j] for x in "qv" for j in range(6)}
        (work / f"{new}.json").write_text(json.dumps({name: column.tolist() for name, column in columns.items()}))
    shutil.copy(rx90_mjcf.MJCF, work / "arm.xml")
    write_recording(Recording(log.t[700:], log.q[700:], log.v[700:]), work / "late.parquet")
    for recipe in RECIPES.values():
        follow(recipe, packages, work)
    # `nominal` moves for 4 s here, and its gains are identified joint by joint
    shutil.copy(plain.setup.scenario.folder / "short.toml", packages / "scenarios/catalog/motions/drive-gains.toml")
    with (packages / "scenarios/catalog/nominal.toml").open("a") as nominal:
        nominal.write('[identification]\nmethod = "ls-2011"\n')
    return packages, work


@pytest.fixture(scope="module")
def outcomes(followed) -> dict[str, Outcome]:
    """The last outcome of each recipe whose commands run."""
    packages, work = followed
    commands = [(name, words) for name, recipe in RECIPES.items() for words in recipe.commands]
    commands += [(name, line.split()) for name, line in MORE.items()]
    found = carried_out(
        [words for _, words in commands],
        work,
        before="from scenarios.results.json_schemas import write_schemas; write_schemas()",
        environment={**os.environ, "PYTHONPATH": str(packages), **dict.fromkeys(ONE_THREAD, "1")},
    )
    return {name: outcome for (name, _), outcome in zip(commands, found, strict=True)}


def test_recipes_fit_the_code_and_what_they_leave_is_as_clean_as_the_rest(followed):
    for words in (["check", "--no-cache"], ["format", "--check", "--no-cache"]):
        command = [sys.executable, "-m", "ruff", *words, "--config", str(ROOT / "pyproject.toml"), *PACKAGES]
        done = subprocess.run(command, cwd=followed[0], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow  # eleven commands
def test_what_recipes_add_does_what_they_say(followed, outcomes, plain):
    packages, work = followed
    for name, outcome in outcomes.items():
        assert outcome.status in (0, 1), (name, outcome.err)
    said = {name: outcome.out for name, outcome in outcomes.items()}
    solution = plain.estimate.solution
    expected = [getattr(joint, "value", None) for joint in plain.estimate.joints]

    heavier = json.loads(said["An estimator"])
    assert heavier["fit"]["method"] == "heavier"
    for gain, value in zip(heavier["gains"], expected, strict=True):
        assert gain["estimate"] == (value and pytest.approx(1.05 * value, rel=1e-9))

    rows, size = solution.rows, solution.rows.residual.copy()
    for j, unknowns in rows.unknowns.items():
        size[rows.joint == j] /= np.sqrt(1.0 - unknowns / np.sum(rows.joint == j))
    deviation = np.linalg.norm(solution.influence * size, axis=1) / solution.inverse**2
    deviation = dict(zip((solution.joints + 1).tolist(), deviation, strict=True))
    known = [gain for gain in json.loads(said["An uncertainty"])["gains"] if gain["std"] is not None]
    assert len(known) > 2
    for gain in known:
        np.testing.assert_allclose(gain["residual_std"], deviation[gain["joint"]], rtol=1e-9)

    assert re.search(r"^another handedness .* excluded$", said["A fault family"], re.MULTILINE)
    assert "the log begins while" not in said["A fault family"]
    assert "the log begins while the arm moves" in said["late"]
    assert [gain["estimate"] for gain in json.loads(said["A log format"])["gains"]] == expected

    def logs(folder: str) -> list[Recording]:
        return [read_recording(work / folder / f"{each}.parquet") for each in ("unloaded", "loaded")]

    for with_it, without in zip(logs("gears"), plain.recordings, strict=True):
        torque, wave = GAIN * (with_it.v - without.v), np.sin(6.0 * without.q)
        # The loop of 8 Hz follows the motion, so the drive adds A sin(k q); it yields by some hundredths.
        slopes = np.sum(wave * torque, axis=0) / np.sum(wave**2, axis=0)
        np.testing.assert_allclose(slopes, 4.0, rtol=0.15)
    for humming, silent in zip(logs("hum"), plain.recordings, strict=True):
        np.testing.assert_array_equal(humming.q, silent.q)
        added = (humming.v - silent.v) / (0.02 * np.sqrt(np.mean(silent.v**2, axis=0)))
        angle = 2.0 * np.pi * 50.0 * silent.t[:, None]
        waves = np.concatenate((np.sin(angle), np.cos(angle)), axis=1)
        np.testing.assert_allclose(np.hypot(*np.linalg.lstsq(waves, added, rcond=None)[0]), 1.0, rtol=1e-9)
    keys = json.loads((packages / "scenarios/schemas/scenario.schema.json").read_text())["$defs"]
    assert keys["ModelErrors"]["properties"]["eccentric_torque"]["maximum"] == 1e3
    assert keys["SensorOptions"]["properties"]["current_hum"]["maximum"] == 0.5

    for gain in json.loads(said["A field of a result"])["gains"]:
        significance = gain["estimate"] and abs(gain["estimate"]) / gain["std"]
        assert gain["significance"] == (significance and pytest.approx(significance, rel=1e-12))
    table = list(csv.reader(said["A report renderer"].splitlines()))
    column = next(k for k, title in enumerate(table[0]) if "N m/unit" in title)
    for row, value in zip(table[1:7], expected, strict=True):
        assert row[column] == "-" if value is None else abs(float(row[column]) - value) < 1e-3
    motion = plain.setup.experiments[0].trajectory
    t = np.linspace(0.0, motion.duration, 2000)
    fastest = np.abs(np.gradient(motion(t)[0], t, axis=0)).max(axis=0)
    np.testing.assert_allclose(json.loads(said["A command"])["fastest"], fastest, rtol=1e-3)  # differences over 3 ms
    assert re.search("^ +speeds +largest", said["help"], re.MULTILINE)


@pytest.mark.slow  # a second process that imports everything
def test_every_new_member_is_put_through_the_tests_of_its_kind(followed):
    packages, work = followed
    contracts = {
        "tests/ident/estimation/test_estimators.py": "heavier",
        "tests/ident/estimation/test_intervals.py": "white",
        "tests/sim/test_effects.py": "EccentricGear",
        "tests/sim/test_sensors.py": "Hum",
    }
    shutil.copytree(ROOT / "tests", packages / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", packages)
    members = [word for each in contracts.values() for word in each.split("|")]
    names = " or ".join(f"[{word} or -{word}" for word in members)  # of parameters: other names have such words too
    words = ["pytest", "-q", "-rA", "-p", "no:cacheprovider", "-k", names, *contracts]
    (done,) = carried_out([words], work, environment={**os.environ, "PYTHONPATH": str(packages)})
    assert done.status == 0, done.out
    for path, each in contracts.items():
        for word in each.split("|"):
            assert re.search(rf"^PASSED {path}::\w+\[[^\]]*\b{word}\b", done.out, re.MULTILINE), (path, word)
