"""Result of `rx90 verify` without gains: currents of each time block predicted from the others."""

from collections.abc import Iterable, Sequence

import numpy as np
from pydantic import Field

from ident.estimation.cross_validation import TIME_BLOCKS, JointPrediction
from ident.identification import Identification
from ident.unseen import Unseen
from scenarios.rendering.content import NONE, Paragraph, Part, column, percent, table
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.results.diagnoses import DiagnosedResult, diagnosed_values, doubt_paragraphs
from scenarios.results.unseen import unseen_parts, unseen_verdict


class PredictedJoint(ResultModel):
    """Cross-validation of a joint's currents.

    Attributes:
        joint: Its number, from 1.
        name: Name of the joint in the robot's model.
        predicted_rel_error: Norm of the prediction error, each part of the motions predicted from the others, relative
            to that of the currents.
        fitted_rel_error: Norm of the residual of a fit of all parts, relative to that of the currents.
        gain_changes: Relative change of the gain without each part; empty if the joint is refused.
    """

    joint: int = Field(ge=1)
    name: str
    predicted_rel_error: float
    fitted_rel_error: float
    gain_changes: list[float]

    @property
    def rms_change(self) -> float:
        """Root mean square of the relative changes of the gain, 0 without any."""
        return float(np.linalg.norm(self.gain_changes)) / max(len(self.gain_changes), 1) ** 0.5

    @property
    def largest_change(self) -> float:
        """Largest relative change of the gain, 0 without any."""
        return max(map(abs, self.gain_changes), default=0.0)


class CrossValidation(DiagnosedResult):
    """What `rx90 verify --json` prints without gains.

    Attributes:
        method: Name of the estimator.
        joints: Joints with rows.
        unseen: Prediction of a motion that was not used in any fit, null if none is given.
    """

    method: str
    joints: list[PredictedJoint]
    unseen: FromOne[Unseen] | None = None

    @classmethod
    def of(
        cls, identified: Identification, found: Sequence[JointPrediction], unseen: Unseen | None = None
    ) -> "CrossValidation":
        """Return the result of a cross-validation."""
        return cls(
            method=identified.estimate.method,
            joints=[
                PredictedJoint(
                    joint=each.joint + 1,
                    name=identified.joints[each.joint].joint,
                    predicted_rel_error=each.share,
                    fitted_rel_error=each.fitted,
                    gain_changes=each.gain_change.tolist(),
                )
                for each in found
            ],
            unseen=unseen,
            **diagnosed_values(identified.found),
        )

    def parts(self) -> Iterable[Part]:
        """Prediction errors and changes of gains."""
        errors = [each.predicted_rel_error for each in self.joints]
        text = f"Currents of time blocks left out are predicted within {percent(min(errors), '.2f')} to "
        text += f"{percent(max(errors), '.2f')} % of rms"
        moved = max(self.joints, key=lambda each: each.largest_change)
        if moved.gain_changes:
            text += f"; no gain changes by more than {percent(moved.largest_change, '.2f')} % (joint {moved.joint})"
        yield Paragraph(f"{text}.", strong=True)
        yield from unseen_verdict(self.unseen)
        yield table(
            self.joints,
            column("Joint", lambda each: each.joint),
            column("Name", lambda each: each.name, words=True),
            column("Prediction error [% of rms]", lambda each: percent(each.predicted_rel_error, ".2f")),
            column("Fit residual [% of rms]", lambda each: percent(each.fitted_rel_error, ".2f")),
            column("Gain change [% rms]", lambda each: _change(each, each.rms_change)),
            column("At most [%]", lambda each: _change(each, each.largest_change)),
        )
        yield Paragraph(
            f"Cross-validation: gains from {TIME_BLOCKS - 1} of {TIME_BLOCKS} time blocks of each motion predict the "
            "currents of the block left out. An error common to all blocks, such as a wrong mass or model, is not "
            "detected; to detect it, record a motion with another payload: --gains G.toml --loaded B --payload P.toml."
        )
        yield from unseen_parts(self.unseen)
        yield from doubt_paragraphs(self.found)


def _change(each: PredictedJoint, share: float) -> str:
    return percent(share, ".2f") if each.gain_changes else NONE
