"""A finished study, read from its folder; nothing is opened for writing."""

import json
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import ValidationError

from ident.support.naming import one_line
from scenarios.experiments.files.schema import Scenario, ScenarioTable
from scenarios.experiments.studies.folder import STUDY, StudyFolder
from scenarios.support.errors import ScenarioError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredStudy:
    """A finished study; `named` is the name of its scenario, `seed` that of the first trial."""

    folder: Path
    kind: str
    scenario: Scenario
    named: str
    seed: int
    trials: int
    command: str
    versions: Mapping[str, object]
    rows: StudyFolder


def read_study(folder: Path) -> StoredStudy:
    """Read a study.

    Raises:
        ScenarioError: If its record is damaged or from another version; if trials are missing.
        StudyError: If a part is damaged or missing.
    """
    path = folder / STUDY
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        kind, stated = record["study"], record["scenario"]
        table = ScenarioTable.model_validate_json(json.dumps({"description": "", **stated["table"]}))
        scenario = Scenario(str(stated["name"]), folder, table)
        trials, seed, command = int(record["trials"]), int(record["seed"]), str(record["command"])
        words, versions = shlex.split(command), dict(record["versions"])
    except (OSError, ValueError, KeyError, TypeError, ValidationError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ScenarioError(f"{one_line(path)}: damaged, or written by another version of rx90: {first}") from error
    held = StudyFolder(folder, len(table.tolerance.gain))
    held = held.as_it_is() if held.trials.is_dir() else replace(held, seen=())
    missing = sum(map(len, held.missing(trials)))
    if missing:
        raise ScenarioError(f"{one_line(folder)}: {missing} of {trials} trials are missing; continue with: {command}")
    return StoredStudy(
        folder=folder,
        kind=str(kind),
        scenario=scenario,
        named=words[2] if len(words) > 2 else scenario.name,
        seed=seed,
        trials=trials,
        command=command,
        versions=versions,
        rows=held,
    )
