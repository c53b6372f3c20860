"""Folder of a run (`--save`), and the command that repeats the identification from it."""

import hashlib
import shlex
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

from ident.payload.payload import write_payload
from ident.recordings.files import write_recording
from ident.recordings.recording import Recording
from scenarios.experiments.robots import robot_file
from scenarios.experiments.run import Run, as_identified
from scenarios.experiments.scenario import CHECK, Setup
from scenarios.experiments.scenario_files import LOADED
from scenarios.experiments.schema import BARE, Scenario, grouped
from scenarios.rendering.result import to_json
from scenarios.results.fit import ROWS, fit_of
from scenarios.results.gains import Result
from scenarios.results.problem_folder import MODELS, GivenProblem, MotionTable
from scenarios.results.record import RECORD, RESULT, coupling_words, identify_words, option_words, save_result

TRUTH = "truth.json"


def run_files(setup: Setup) -> tuple[str, ...]:
    """Return the names of written files: recordings, payloads, arm, true values, result and its rows."""
    recordings = [f"{experiment.name}.parquet" for experiment in setup.experiments]
    check = [] if setup.check is None else [f"{CHECK}.parquet", payload_file(CHECK)]
    return (*recordings, *map(payload_file, setup.payloads), *check, *MODELS, TRUTH, RESULT, ROWS, RECORD)


def payload_file(mounting: str) -> str:
    """Return the name of a payload file."""
    return "payload.toml" if mounting == LOADED else f"payload-{mounting}.toml"


def simulated_problem(setup: Setup, recordings: Sequence[Recording]) -> GivenProblem:
    """Return the problem of recordings of a scenario."""
    chosen, robot = setup.scenario.table.identification, setup.experiments[0].plant.robot
    return GivenProblem(
        model=robot.model,
        flange=robot.flange,
        arm=setup.structure.arm,
        motions=as_identified(setup, recordings),
        observing=chosen.observe,
        gains=chosen.gains,
        method=chosen.method,
        options=chosen.method_options,
    )


def save_run(run: Run, folder: Path, *, command: str = "", named: str | None = None) -> None:
    """Write recordings, assumed payloads, arm, true values, result and its rows, and the record.

    `identify_command` gives the same estimate on them, to the last digit. `named` is the scenario as the user names it.
    """
    setup, more = run.setup, [TRUTH]
    if run.check is not None and run.cost is not None:
        more += [f"{CHECK}.parquet", payload_file(CHECK)]
        write_recording(run.check, folder / more[1])
        write_payload(run.cost.assumed.weighed.payload, folder / more[2])
    drives, bodies = setup.experiments[0].plant.drives, {name: asdict(x) for name, x in setup.true_payloads.items()}
    truth = {
        "drives": {field.name: getattr(drives, field.name).tolist() for field in fields(drives)},
        **({"payload": bodies[LOADED]} if LOADED in bodies else {}),
        "payloads": bodies,
    }
    (folder / TRUTH).write_text(to_json(truth) + "\n", encoding="utf-8")
    prepared = run.identification.prepared
    assert prepared is not None, "a run has what it was identified from"
    save_result(
        folder,
        Result.of_run(run),
        simulated_problem(setup, run.recordings),
        kind="run",
        title=f"Scenario {setup.scenario.name}, seed {run.seed}: {setup.scenario.table.description}",
        command=command,
        names=_motions(setup),
        fit=fit_of(prepared, run.estimate),
        more=more,
        scenario=named,
        scene=None if named is None else scene_digest(setup.scenario),
    )


def model_words(setup: Setup) -> list[str]:
    """Return the arguments for the arm: model file, flange and couplings, or a robot file with a transmission."""
    robot, scenario = setup.experiments[0].plant.robot, setup.scenario
    if robot.transmission is not None:
        return [str(robot_file(scenario.table.robot, scenario.folder))]
    flange = [] if robot.flange is None else ["--flange", robot.flange]
    return [str(robot.model.resolve()), *flange, *coupling_words(scenario.table.belief.couplings)]


def identify_command(setup: Setup, folder: Path) -> str:
    """Return the command that gives the same estimate from the files of `save_run`, to the last digit."""
    chosen = setup.scenario.table.identification
    words = ["rx90", "identify", "--model", *model_words(setup), *identify_words(folder, _motions(setup))]
    options = option_words(asdict(chosen.observe), asdict(chosen.gains), chosen.options)
    return shlex.join([*words, "--method", chosen.method, *options])


def _motions(setup: Setup) -> tuple[MotionTable, ...]:
    """Return recordings in the order of identification, by file name."""
    return tuple(
        MotionTable(
            recording=f"{setup.experiments[k].name}.parquet",
            payload=None if setup.protocol[k] == BARE else payload_file(setup.protocol[k]),
        )
        for k in grouped(setup.protocol)
    )


def scene_digest(scenario: Scenario) -> str:
    """Return the SHA-256 of the tables that a picture of a scenario depends on."""
    shown = scenario.table.model_dump(mode="json", include={"robot", "experiment", "plant"})
    return hashlib.sha256(to_json(shown).encode()).hexdigest()
