"""JSON Schema of gains in use: torques from currents, models that are patched, two sets of gains compared."""

from pydantic import Field

from scenarios.gains_in_use.model_update.places import Change
from scenarios.support.result_model import ResultModel


class Torques(ResultModel):
    """What `rx90 torque --json` prints.

    Attributes:
        out: The file that was written.
        samples: Of the recording, and rows of that file.
    """

    out: str
    samples: int
    joints: list[int] = Field(description="that have columns")
    missing: list[dict[str, int | str]] = Field(description="joints that have none, with the reason")
    notes: list[str] = Field(description="on gains that look odd")


class Patched(ResultModel):
    """What `rx90 patch --json` prints.

    Attributes:
        out: The model that was written.
        ros_params: The file of ROS 2 parameters that was written, null for none.
        changes: Attributes of joints, those that are left alone too.
        notes: On gains that look odd.
    """

    out: str
    ros_params: str | None
    changes: list[Change]
    notes: list[str]


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
    turned: bool = Field(description="whether its sign is another")
    moved: bool = Field(description="whether it changed beyond its interval")


class MovedJoint(Moved):
    """A joint's gain; `apart`: once a scale common to all joints is taken out.

    Attributes:
        joint: Its number, from 1.
        apart: Its change beside that common to all joints.
    """

    joint: int = Field(ge=1)
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
        pattern: Whether what is left beside the common change is more than chance, null for a single joint.
    """

    moved: bool
    joints: list[MovedJoint]
    scale: Moved
    scale_joints: list[int]
    together: ChiSquare
    pattern: ChiSquare | None
    missing: list[dict[str, int | str]] = Field(description="joints that one of both has")
