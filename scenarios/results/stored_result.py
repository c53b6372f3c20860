"""`result.json` of a run or an identification, read back as the values it was written from."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Exclusion
from ident.estimation.estimate import FoundParameter, IdentifiedGain, JointResult, RefusedGain
from ident.support.naming import one_line
from scenarios.experiments.judge import GainVerdict
from scenarios.support.errors import ForeignResult


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


class StoredResult(_Table):
    """A result of `rx90 run` or `rx90 identify`; joints from 1."""

    scenario: str | None
    seed: int | None
    gains: tuple[StoredGain, ...]
    payload: tuple[StoredParameter, ...]
    fit: StoredFit
    timing: Mapping[str, float | None]
    notes: tuple[str, ...]
    diagnoses: tuple[Diagnosis, ...]
    excluded: tuple[Exclusion, ...]
    untold: tuple[str, ...]

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
            diagnoses=tuple(map(_diagnosis, self.diagnoses)),
            excluded=tuple(replace(each, joints=_from_0(each.joints)) for each in self.excluded),
            indistinguishable=self.untold,
        )

    @property
    def parameters(self) -> tuple[FoundParameter, ...]:
        """As the method found them."""
        return tuple(FoundParameter(name=each.parameter, value=each.estimate, std=each.std) for each in self.payload)


def _diagnosis(stored: Diagnosis) -> Diagnosis:
    effects = tuple(replace(each, joint=each.joint - 1) for each in stored.effects)
    return replace(stored, joints=_from_0(stored.joints), effects=effects)


def _from_0(joints: Sequence[int]) -> tuple[int, ...]:
    return tuple(joint - 1 for joint in joints)


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
