"""Identify again from a folder what was identified once, and hold one against the other."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from ident.estimation.estimate import GainEstimate, IdentifiedGain, JointResult
from ident.estimation.estimators import estimator
from ident.estimation.problem import Problem
from ident.identification import without_spoilt
from ident.preparation import KNOWN, SIMULATED, prepare
from ident.recordings.motion import Motion
from ident.support.errors import IdentificationError
from ident.support.options import options_from_table
from scenarios.results.problem_folder import GivenProblem
from scenarios.results.record import RECORD, RESULT, RecordFile, read_record, recorded_problem
from scenarios.results.stored_result import StoredResult, read_result
from scenarios.support.errors import DamagedResult

SAME = 1e-9
"""Relative difference of two gains that are the same on another machine."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Again:
    """A result, and what proves it.

    Attributes:
        folder: Where it lies.
        record: What the folder says of itself.
        result: As it was saved.
        motions: Recordings and payloads, in the order they were taken, by the names they had.
        given: Them as the folder has them, with arm and options.
        problem: Their linear systems.
        estimate: What identification gives now; what the diagnoses of the result refuse is refused here too.
        differences: Where that is not what was saved, in words.
        document: What was saved, as JSON values.
    """

    folder: Path
    record: RecordFile
    result: StoredResult
    motions: tuple[Motion, ...]
    given: GivenProblem
    problem: Problem
    estimate: GainEstimate
    differences: tuple[str, ...]
    document: Mapping[str, object]


def identified_again(folder: Path) -> Again:
    """Read the folder of a run or an identification, and identify again.

    Raises:
        ForeignResult: If it holds none, or one of another version.
        DamagedResult: If a file is missing or changed, or the files give no estimate any more.
    """
    record = read_record(folder)
    result = read_result(folder / RESULT)
    try:
        given = recorded_problem(folder, record)
        method = estimator(record.method or "")
        options = options_from_table(method.options, record.options)
        motions = tuple(
            Motion(replace(each.recording, name=name), each.payload)
            for each, name in zip(given.motions, record.sources, strict=True)
        )
        with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS
            policy = SIMULATED if record.kind == "run" else KNOWN
            prepared = prepare(motions, given.arm, observing=given.observing, gains=given.gains, policy=policy)
            estimate = without_spoilt(method.estimate(prepared.problem, options), result.found.diagnoses)
    except IdentificationError as error:
        raise DamagedResult(f"{folder / RECORD}: the files of this folder give no estimate: {error}") from error
    return Again(
        folder=folder,
        record=record,
        result=result,
        motions=prepared.motions,
        given=given,
        problem=prepared.problem,
        estimate=estimate,
        differences=differences(result.joints, estimate.joints),
        document=json.loads((folder / RESULT).read_text(encoding="utf-8")),
    )


def differences(saved: tuple[JointResult, ...], now: tuple[JointResult, ...]) -> tuple[str, ...]:
    """Where two results differ by more than `SAME`, a phrase a joint."""
    if len(saved) != len(now):
        return (f"{len(saved)} joints were saved, now there are {len(now)}",)
    found: list[str] = []
    for number, (there, here) in enumerate(zip(saved, now, strict=True), 1):
        pairs = zip(_numbers(there), _numbers(here), strict=True)
        if not all(math.isclose(a, b, rel_tol=SAME) for a, b in pairs):
            found.append(f"joint {number}: {_words(there)} was saved, but now it is {_words(here)}")
    return tuple(found)


def _numbers(joint: JointResult) -> tuple[float, float]:
    return (joint.value, joint.total_std) if isinstance(joint, IdentifiedGain) else (0.0, 0.0)


def _words(joint: JointResult) -> str:
    if not isinstance(joint, IdentifiedGain):
        return "a refusal"
    return f"{joint.value:.6g} with a deviation of {joint.total_std:.3g}"
