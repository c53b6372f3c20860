"""What `identify` says of one set of logs, as a record that a line of JSON holds."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache
from unittest.mock import patch

import numpy as np
from diagnosis_cases import SoundCase
from diagnosis_faults import FaultyCase
from diagnosis_visibility import solved, twin_of

from ident import identification, preparation
from ident.check import check
from ident.diagnosis import diagnose as diagnosing
from ident.diagnosis.alternative import Alternative
from ident.diagnosis.candidates import Compared
from ident.diagnosis.diagnosis import Diagnosis
from ident.diagnosis.engine import Survey
from ident.estimation.estimate import IdentifiedGain
from ident.estimation.gain_options import GainOptions
from ident.identification import identify
from ident.model.structure import Structure, structure_of
from ident.observation.observation import ObserveOptions
from ident.preparation import DOUBTED
from ident.recordings.motion import Motion
from ident.support.arrays import Array
from ident.support.errors import Contradiction, IdentificationError


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """A diagnosis that is not good.

    Attributes:
        name: Its family.
        severity: `weak` or `wrong`.
        sentence: Its words.
        joints: From 0.
        logs: Names.
        value: Size, None where it has none.
        std: Of the size.
        z: Standard errors, None of samples.
        percent: Largest error of a gain [%].
        deviations: The same in estimated standard deviations.
        rivals: Alternatives that cannot be distinguished from it.
    """

    name: str
    severity: str
    sentence: str
    joints: list[int]
    logs: list[str]
    value: float | None
    std: float | None
    z: float | None
    percent: float | None
    deviations: float | None
    rivals: list[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What was said of one set of logs.

    Attributes:
        name: Of the case, and of the fault if there is one.
        error: Class of the error that refused all, None if gains were given.
        message: Its words.
        crashed: Whether the error is none of identification.
        said: Diagnoses that are not good; of logs that are refused those that refuse them.
        gains: Value, estimated and predicted standard deviation of each joint; None if refused.
        reasons: Why joints are refused.
        excluded: What is excluded: family and sentence.
        untold: What is said not to be told.
        largest_z: Of all small faults of logs, None where there was no comparison.
        seconds: That it took.
        twin: Of a fault, what it does to logs without noise; None of sound logs.
    """

    name: str
    error: str | None = None
    message: str = ""
    crashed: bool = False
    said: list[Said] = field(default_factory=list)
    gains: list[tuple[float, float, float] | None] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    excluded: list[tuple[str, str]] = field(default_factory=list)
    untold: list[str] = field(default_factory=list)
    largest_z: float | None = None
    seconds: float = 0.0
    twin: "Twin | None" = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """A fault in logs that the model explains exactly.

    Attributes:
        residual: Largest share of a joint's current that is not explained.
        moved: Largest relative error of the size of a gain; None where one is lost.
        left: Share of the residual that is left once the logs are read as diagnosed, None where nothing says how.
        still: As `moved`, of the gains read so.
    """

    residual: float
    moved: float | None
    left: float | None = None
    still: float | None = None


@dataclass(slots=True, eq=False)
class Heard:
    """What the engine has at hand while it works, and does not tell."""

    refusing: list[Diagnosis] = field(default_factory=list)
    largest_z: float | None = None
    readings: list[Alternative] = field(default_factory=list)


@contextmanager
def overheard() -> Iterator[Heard]:
    """Listen to the engine: an error has words only, a diagnosis no reading."""
    heard = Heard()
    refusal_of, survey, faults = identification.refusal_of, diagnosing.survey, diagnosing.faults

    def refusing(wrong: Sequence[Diagnosis]) -> str:
        heard.refusing = list(wrong)
        return refusal_of(wrong)

    def surveyed(*given: object) -> Survey:
        found = survey(*given)  # pyright: ignore[reportArgumentType]
        of_logs = [each.z for each in found.small if each.direction.alternative is not None]
        heard.largest_z = max(of_logs, default=None)
        return found

    def found(*given: object):
        for each in faults(*given):  # pyright: ignore[reportArgumentType]
            if isinstance(each.found, Compared):
                heard.readings.append(each.found.alternative)
            yield each

    with (
        patch.object(identification, "refusal_of", refusing),
        patch.object(preparation, "refusal_of", refusing),
        patch.object(diagnosing, "survey", surveyed),
        patch.object(diagnosing, "faults", found),
    ):
        yield heard


def said(found: Diagnosis) -> Said:
    """What is kept of a diagnosis."""
    worst = found.worst
    return Said(
        name=found.name,
        severity=found.severity.value,
        sentence=found.sentence,
        joints=list(found.joints),
        logs=list(found.logs),
        value=found.value,
        std=found.std,
        z=found.z,
        percent=None if worst is None else worst.percent,
        deviations=None if worst is None else worst.deviations,
        rivals=list(found.rivals),
    )


def run(name: str, motions: Sequence[Motion], structure: Structure) -> tuple[Run, list[Alternative]]:
    """Doubt one set of logs; nothing is raised."""
    started = time.perf_counter()
    with overheard() as heard:
        try:
            found = _answer(name, motions, structure)
        except Exception as error:  # a study counts what breaks
            refusing = heard.refusing if isinstance(error, Contradiction) else []
            found = Run(
                name=name,
                error=type(error).__name__,
                message=str(error),
                crashed=not isinstance(error, IdentificationError),
                said=[said(each) for each in refusing],
            )
    return replace(found, largest_z=heard.largest_z, seconds=time.perf_counter() - started), heard.readings


def _answer(name: str, motions: Sequence[Motion], structure: Structure) -> Run:
    """What is identified, of bare motions what a check says.

    Raises:
        IdentificationError: If all is refused.
    """
    if all(each.payload is None for each in motions):
        logs = [each.recording for each in motions]
        checked = check(logs, structure, observing=ObserveOptions(), gains=GainOptions())
        return Run(name=name, said=[said(each) for each in checked.found.doubts])
    found = identify(structure, motions, policy=DOUBTED)
    joints = found.estimate.joints
    return Run(
        name=name,
        said=[said(each) for each in found.found.findings],
        gains=[_numbers(each) if isinstance(each, IdentifiedGain) else None for each in joints],
        excluded=[(each.family, each.sentence) for each in found.found.excluded],
        untold=list(found.found.indistinguishable),
        reasons=[f"{each.joint}: {each.reason}" for each in joints if not isinstance(each, IdentifiedGain)],
    )


def _numbers(gain: IdentifiedGain) -> tuple[float, float, float]:
    return gain.value, gain.std, gain.predicted_rel_std * abs(gain.value)


def run_sound(case: SoundCase) -> Run:
    """Run one case without a fault."""
    return run(case.name, case.motions, case.structure)[0]


def run_faulty(faulty: FaultyCase) -> Run:
    """Run one fault: its effect without noise, and what remains once the logs are read as diagnosed."""
    found, readings = run(faulty.name, faulty.motions, faulty.structure)
    return replace(found, twin=_twin(faulty, readings))


def _twin(faulty: FaultyCase, readings: Sequence[Alternative]) -> Twin | None:
    twin, true = _sound_twin(faulty.case)
    try:
        motions, structure = faulty.fault.apply(twin, faulty.case.structure)
        now, residual = solved(motions, structure)
        before = float(residual.max())
        if not readings:
            return Twin(residual=before, moved=_moved(true, now))
        for each in readings:
            if len(each.hypothesis.logs) != len(motions):
                return Twin(residual=before, moved=_moved(true, now))
            motions = tuple(
                replace(motion, recording=how.read(motion.recording))
                for motion, how in zip(motions, each.hypothesis.logs, strict=True)
            )
            arm = each.hypothesis.of_arm(structure.arm)
            structure = structure if arm is structure.arm else structure_of(arm)
        then, residual = solved(motions, structure)
    except (IdentificationError, np.linalg.LinAlgError):
        return None
    return Twin(
        residual=before, moved=_moved(true, now), left=float(residual.max()) / max(before, 1e-12),
        still=_moved(true, then),
    )  # fmt: skip


def _moved(true: Array, found: Array) -> float | None:
    """Largest relative error of the size of a gain; None where one is lost."""
    held = np.isfinite(true)
    if np.isnan(found[held]).any():
        return None
    return float(np.abs(np.abs(true[held] / found[held]) - 1.0).max(initial=0.0))


@lru_cache(maxsize=2)
def _sound_twin(case: SoundCase) -> tuple[tuple[Motion, ...], Array]:
    twin = twin_of(case)
    return twin, solved(twin, case.structure)[0]


def as_row(found: Run) -> dict[str, object]:
    """For a line of JSON."""
    return asdict(found)


def from_row(row: dict[str, object]) -> Run:
    """Of a line of JSON."""
    return Run(
        **{
            **row,
            "said": [Said(**each) for each in row["said"]],
            "twin": None if row["twin"] is None else Twin(**row["twin"]),
        }
    )
