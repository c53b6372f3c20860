"""`result.json` of a run or an identification, read back as the values it was written from."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Exclusion, Severity
from ident.estimate import FoundParameter, IdentifiedGain, JointResult, RefusedGain
from ident.naming import one_line
from scenarios.errors import ForeignResult
from scenarios.judge import GainVerdict


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class StoredGain(_Table):
    """One joint; what needs a truth is None without one."""

    joint: int
    name: str
    true: float | None
    estimate: float | None
    std: float | None
    rel_error: float | None
    z: float | None
    tolerance: float | None
    identifiable: bool
    passed: bool | None
    reason: str | None
    residual_std: float | None
    payload_std: float | None
    model_std: float | None
    predicted_rel_std: float | None

    @property
    def result(self) -> JointResult:
        """As identification gave it."""
        if self.estimate is None:
            return RefusedGain(joint=self.name, reason=self.reason or "", predicted_rel_std=self.predicted_rel_std)
        assert self.residual_std is not None, "a gain has all its parts"
        assert self.payload_std is not None, "a gain has all its parts"
        assert self.model_std is not None, "a gain has all its parts"
        assert self.predicted_rel_std is not None, "a gain has all its parts"
        size = abs(self.estimate)
        return IdentifiedGain(
            joint=self.name,
            value=self.estimate,
            std=self.residual_std,
            payload_rel_std=self.payload_std / size,
            model_rel_std=self.model_std / size,
            predicted_rel_std=self.predicted_rel_std,
        )

    @property
    def verdict(self) -> GainVerdict:
        """As it was judged."""
        assert self.true is not None, "asked of what was judged"
        assert self.tolerance is not None, "asked of what was judged"
        return GainVerdict(
            joint=self.joint,
            true=self.true,
            estimate=self.estimate,
            std=self.std,
            rel_error=self.rel_error,
            z=self.z,
            tolerance=self.tolerance,
            identifiable=self.identifiable,
            passed=bool(self.passed),
            reason=self.reason,
        )


class StoredParameter(_Table):
    """A payload parameter that was found on the way."""

    parameter: str
    estimate: float
    std: float


class StoredFit(_Table):
    """How good the fit is."""

    method: str
    rows: int
    rel_error_norm: float


class StoredEffect(_Table):
    """What a fault does to a joint, from 1."""

    joint: int
    percent: float
    deviations: float | None


class StoredDiagnosis(_Table):
    """A diagnosis; joints from 1."""

    name: str
    severity: Severity
    sentence: str
    advice: str | None
    joints: tuple[int, ...]
    logs: tuple[str, ...]
    value: float | None
    std: float | None
    unit: str | None
    z: float | None
    effects: tuple[StoredEffect, ...]
    rivals: tuple[str, ...]

    @property
    def diagnosis(self) -> Diagnosis:
        """As it was made."""
        given = {name: getattr(self, name) for name in type(self).model_fields if name not in ("joints", "effects")}
        effects = tuple(
            Effect(joint=each.joint - 1, percent=each.percent, deviations=each.deviations) for each in self.effects
        )
        return Diagnosis(**given, joints=tuple(joint - 1 for joint in self.joints), effects=effects)


class StoredExclusion(_Table):
    """What was excluded; joints from 1."""

    family: str
    sentence: str
    joints: tuple[int, ...]
    limit: float | None
    unit: str | None


class StoredResult(_Table):
    """A result of `rx90 run` or `rx90 identify`."""

    scenario: str | None
    seed: int | None
    gains: tuple[StoredGain, ...]
    payload: tuple[StoredParameter, ...]
    fit: StoredFit
    timing: Mapping[str, float | None]
    notes: tuple[str, ...]
    diagnoses: tuple[StoredDiagnosis, ...]
    excluded: tuple[StoredExclusion, ...] = ()
    untold: tuple[str, ...] = ()

    @property
    def judged(self) -> bool:
        """Whether there was a truth."""
        return all(gain.true is not None for gain in self.gains)

    @property
    def joints(self) -> tuple[JointResult, ...]:
        """As identification gave them."""
        return tuple(gain.result for gain in self.gains)

    @property
    def found(self) -> Diagnosed:
        """What was said of logs and estimate."""
        return Diagnosed(
            diagnoses=tuple(each.diagnosis for each in self.diagnoses),
            excluded=tuple(
                Exclusion(
                    family=each.family, sentence=each.sentence, joints=tuple(joint - 1 for joint in each.joints),
                    limit=each.limit, unit=each.unit,
                )
                for each in self.excluded
            ),
            untold=self.untold,
        )  # fmt: skip

    @property
    def parameters(self) -> tuple[FoundParameter, ...]:
        """As the method found them."""
        return tuple(FoundParameter(name=each.parameter, value=each.estimate, std=each.std) for each in self.payload)


def read_result(path: Path) -> StoredResult:
    """Read a result.

    Raises:
        ForeignResult: If it is none, or one of another version.
    """
    try:
        return StoredResult.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, ValidationError) as error:
        first = one_line(" ".join(str(error).splitlines()[:3]))
        raise ForeignResult(f"{one_line(path)}: no result of this version of rx90: {first}; save it again") from error
