"""Prediction of a motion that was not used in any fit."""

from typing import Literal

from pydantic import Field

from ident.diagnosis.plausibility import LARGE_RESIDUAL
from ident.unseen import Unseen, beyond_chance
from scenarios.results.models.diagnoses import DiagnosedResult, diagnosed_values
from scenarios.support.result_model import ResultModel


class UnseenJoint(ResultModel):
    """A joint's currents on a motion that was not used in any fit; null if the joint has no gain.

    Attributes:
        joint: Number of the joint, from 1.
        rel_error: Norm of the prediction's error relative to that of the currents.
        explained: Share of the squared currents that is predicted, one minus the square of `rel_error`.
        other_rel_error: As `rel_error`, relative, with the other gains or the unchanged model.
        fitted_rel_error: Norm of the residual relative to that of the currents, of the fitted motions; null for a model
            file.
        largest_rel_error: Largest `rel_error` of a predicted motion: three times the cross-validation error of the fit
            with the standard deviations of arm, gain and payload, at most 15 %; relative.
        gain_rel_error: Relative error of the gain according to the payload on this motion, positive if it is too large;
            null for a bare motion and for the arm of a model file.
        gain_rel_std: Standard deviation of `gain_rel_error`, relative.
        unstated_rel: Norm of the currents of offset and missing rotor inertia, which the model file does not state,
            relative to that of the currents; the prediction includes them, as --arm has them; null for an identified
            arm.
    """

    joint: int = Field(ge=1)
    rel_error: float | None
    explained: float | None
    other_rel_error: float | None
    fitted_rel_error: float | None
    largest_rel_error: float | None = None
    gain_rel_error: float | None = None
    gain_rel_std: float | None = None
    unstated_rel: float | None = None

    @property
    def exceeds(self) -> bool:
        """Whether the error exceeds its limit."""
        largest = self.largest_rel_error
        return self.rel_error is not None and largest is not None and self.rel_error > largest

    @property
    def doubted(self) -> bool:
        """Whether the payload significantly contradicts the gain."""
        return beyond_chance(self.gain_rel_error, self.gain_rel_std)

    @property
    def misjudged(self) -> bool:
        """Whether it does so by more than a model of plain friction and stiff joints explains."""
        return self.doubted and abs(self.gain_rel_error or 0.0) > LARGE_RESIDUAL


class ResultUnseen(DiagnosedResult):
    """Prediction of a motion that was not used in any fit."""

    log: str = Field(description="Recording of the motion")
    loaded: bool = Field(description="Whether the motion carries a payload")
    verdict: Literal["better", "worse", "no different"] | None = Field(
        description=(
            "Whether the motion is predicted better than with the other gains or model, by Student's t-test of time "
            "blocks at 5 %; null if there are no others"
        )
    )
    rel_error: float = Field(
        description=(
            "Root mean square of the joints' relative errors; in a comparison, of the joints that both predict"
        )
    )
    other_rel_error: float | None = Field(description="Relative error with the other gains or model")
    joints: list[UnseenJoint] = Field(description="One entry per joint, in order")

    @property
    def passed(self) -> bool:
        """Whether currents are predicted, better than by the others if any, and no payload contradicts a gain."""
        return self.verdict in (None, "better") and self.not_worse

    @property
    def not_worse(self) -> bool:
        """Whether currents are predicted, not worse than by the others if any, and no payload contradicts a gain."""
        return self.verdict != "worse" and not any(each.exceeds or each.misjudged for each in self.joints)

    @property
    def fitted(self) -> bool:
        """Whether the arm was fitted to motions, not read from a file."""
        return any(each.fitted_rel_error is not None for each in self.joints)

    @classmethod
    def of(cls, found: Unseen) -> "ResultUnseen":
        """Return the result of a prediction."""
        return cls(
            log=found.name,
            loaded=found.loaded,
            verdict=found.verdict,  # pyright: ignore[reportArgumentType]
            rel_error=found.rel_error,
            other_rel_error=found.other_rel_error,
            joints=[
                UnseenJoint(
                    joint=each.joint + 1,
                    rel_error=each.rel_error,
                    explained=None if each.rel_error is None else 1.0 - each.rel_error**2,
                    other_rel_error=each.other_rel_error,
                    fitted_rel_error=each.fitted_rel_error,
                    largest_rel_error=each.largest,
                    gain_rel_error=each.gain_error,
                    gain_rel_std=each.gain_std,
                    unstated_rel=each.unstated,
                )
                for each in found.joints
            ],
            **diagnosed_values(found.found),
        )
