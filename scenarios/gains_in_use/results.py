"""Result of a comparison of two sets of gains."""

from pydantic import Field

import ident.estimation.gain_comparison as gain_comparison
from scenarios.rendering.result import ResultModel


class Moved(ResultModel):
    """Change of a gain.

    Attributes:
        rel_change: Relative change of its magnitude, |g_B / g_A| - 1.
        std: Standard deviation of log |g_B / g_A|, for small changes equal to that of the relative change.
        rel_std: Standard deviation of `rel_change`, `std` times |g_B / g_A|; relative.
    """

    rel_change: float
    std: float
    rel_std: float
    turned: bool = Field(description="Whether the sign of the gain changed")
    moved: bool = Field(description="Whether the change is significant")


class _Numbered(ResultModel):
    joint: int = Field(ge=1, description="Number of the joint, from 1")


class MovedJoint(Moved, _Numbered):
    """Change of a joint's gain; `apart`: relative to the common factor.

    Attributes:
        apart: Its change relative to the common factor.
    """

    apart: Moved


class ChiSquare(ResultModel):
    """A test of all joints together.

    Attributes:
        chi2: Sum of the squared changes over their standard deviations, with correlations between joints.
        freedom: Degrees of freedom.
        p: Probability of a value at least as large without a change.
    """

    chi2: float
    freedom: int
    p: float


class GainComparison(ResultModel):
    """What `rx90 verify A.toml B.toml --json` prints.

    Attributes:
        moved: Whether a change is significant, of a joint or of all together.
        joints: Joints with a gain in both files.
        scale: The change common to most joints, or the mean change if no majority has a common one.
        scale_joints: Numbers of the joints with the common change; empty if these are not a majority.
        together: Chi-squared test of no change of any joint.
        pattern: Chi-squared test of one change common to all joints, null for a single joint.
    """

    moved: bool
    joints: list[MovedJoint]
    scale: Moved
    scale_joints: list[int]
    together: ChiSquare
    pattern: ChiSquare | None
    missing: list[dict[str, int | str]] = Field(description="Joints with a gain in one file only")


def gain_comparison_result(found: gain_comparison.GainComparison) -> GainComparison:
    """Return the comparison of two sets of gains."""
    return GainComparison(
        moved=found.moved,
        joints=[
            MovedJoint(joint=j + 1, **_moved(each).model_dump(), apart=_moved(apart))
            for j, each, apart in zip(found.joints.tolist(), found.each, found.apart, strict=True)
        ],
        scale=_moved(found.scale),
        scale_joints=[j + 1 for j in found.sharing.tolist()],
        together=_tested(found.together),
        pattern=None if found.pattern is None else _tested(found.pattern),
        missing=[{"joint": j + 1, "only_in": which} for j, which in found.missing],
    )


def _moved(each: gain_comparison.Moved) -> Moved:
    return Moved(rel_change=each.rel, std=each.std, rel_std=each.rel_std, turned=each.turned, moved=each.moved)


def _tested(test: gain_comparison.Together) -> ChiSquare:
    return ChiSquare(chi2=test.chi2, freedom=test.freedom, p=test.p)
