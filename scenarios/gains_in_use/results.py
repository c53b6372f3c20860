"""What commands that use gains print: torques from currents, models that are patched, two sets of gains compared."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

import ident.estimation.gain_comparison as gain_comparison
from ident.estimation.joint_torque import JointTorque
from ident.support.naming import one_line
from ident.unseen import Unseen
from scenarios.experiments.files.gains import GainsFile
from scenarios.gains_in_use.model_update.edits import Change
from scenarios.results.models.unseen import ResultUnseen
from scenarios.support.result_model import ResultModel


class Torques(ResultModel):
    """What `rx90 torque --json` prints.

    Attributes:
        out: The file that was written.
        samples: Of the recording, and rows of that file.
    """

    out: str
    samples: int
    joints: list[int] = Field(description="Joints that have columns")
    missing: list[dict[str, int | str]] = Field(description="Joints without columns, with the reason")
    notes: list[str] = Field(description="Remarks on implausible gains")


def torques(found: JointTorque, file: GainsFile, out: Path) -> Torques:
    """Torques that were written.

    Args:
        found: Torques.
        file: The gains that they were found with.
        out: The file.
    """
    return Torques(
        out=str(out),
        samples=len(found.t),
        joints=[joint + 1 for joint in found.joints.tolist()],
        missing=[
            {"joint": entry.joint, "reason": one_line(entry.reason or "its gain is refused")}
            for entry in file.gains
            if not entry.identifiable
        ],
        notes=list(file.notes),
    )


class Patched(ResultModel):
    """What `rx90 patch --json` prints.

    Attributes:
        out: The model that was written.
        ros_params: The file of ROS 2 parameters that was written, null for none.
        changes: Attributes of joints, those that are left alone too.
        notes: On gains that look odd.
        written: Whether it was written: a copy that predicts no better than the model is written with --force alone.
        unseen: How well a motion that was not used in any fit is predicted by copy and model, null where none is given.
    """

    out: str
    ros_params: str | None
    changes: list[Change]
    notes: list[str]
    written: bool = True
    unseen: ResultUnseen | None = None


def patched(
    changes: Sequence[Change],
    gains: GainsFile,
    out: Path,
    parameters: Path | None,
    unseen: Unseen | None = None,
    *,
    written: bool = True,
) -> Patched:
    """A model that was written.

    Args:
        changes: Of the model.
        gains: That they were made with.
        out: The model that was written.
        parameters: The parameter file that was written, None for none.
        unseen: A motion that was not used in any fit, None where there is none.
        written: Whether it was.
    """
    return Patched(
        out=str(out),
        ros_params=None if parameters is None else str(parameters),
        changes=list(changes),
        notes=list(gains.notes),
        written=written,
        unseen=None if unseen is None else ResultUnseen.of(unseen),
    )


class Moved(ResultModel):
    """A gain that may have changed, by its logarithm.

    Attributes:
        rel_change: Relative change of its size, g_B / g_A - 1.
        std: Standard deviation of log |g_B / g_A|, of small changes the same as that of the relative change.
        rel_std: Standard deviation of `rel_change`, `std` times g_B / g_A; relative, without unit.
    """

    rel_change: float
    std: float
    rel_std: float
    turned: bool = Field(description="Whether the sign of the gain changed")
    moved: bool = Field(description="Whether the change is significant")


class _Numbered(ResultModel):
    joint: int = Field(ge=1, description="Number of the joint, from 1")


class MovedJoint(Moved, _Numbered):
    """A joint's gain; `apart`: once a scale common to all joints is taken out.

    Attributes:
        apart: Its change beside that common to all joints.
    """

    apart: Moved


class ChiSquare(ResultModel):
    """A test of all joints together.

    Attributes:
        chi2: Sum of the squared changes over their deviations, with correlations between joints.
        freedom: Its degrees of freedom.
        p: Probability that chance alone makes it as large.
    """

    chi2: float
    freedom: int
    p: float


class GainComparison(ResultModel):
    """What `rx90 compare-gains --json` prints.

    Attributes:
        moved: Whether anything did: a joint beyond its interval, or all together.
        joints: Those that have a gain in both.
        scale: The change common to most joints, or to all if no majority has one.
        scale_joints: Numbers of those that have it in common; empty if fewer than half have one.
        together: Whether the changes of all joints are more than chance.
        pattern: Chi-squared test that all gains changed by the common scale alone, null for a single joint.
    """

    moved: bool
    joints: list[MovedJoint]
    scale: Moved
    scale_joints: list[int]
    together: ChiSquare
    pattern: ChiSquare | None
    missing: list[dict[str, int | str]] = Field(description="Joints with a gain in one file only")


def gain_comparison_result(found: gain_comparison.GainComparison) -> GainComparison:
    """What moved from one set of gains to another."""
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
