"""JSON Schema of designs: a robot begun from its model, a payload made for a scenario."""

from pydantic import Field

from scenarios.support.result_model import ResultModel


class NewRobot(ResultModel):
    """What `rx90 new-robot --json` prints.

    Attributes:
        robot: Its name.
        joints: Names of the joints in their order.
        predicted_rel_std: Relative standard deviation of each gain that the motion found lets one expect, for residuals
            of 2 % of the torque.
        identifiable: Whether the scenario that was written wants each joint's gain.
        files: That were written.
    """

    robot: str
    joints: list[str]
    predicted_rel_std: list[float]
    identifiable: list[bool]
    files: list[str]


class DesignedJoint(ResultModel):
    """What a joint sees of a payload.

    Attributes:
        joint: Its number, from 1.
        wanted: Whether a weight is searched that shows its gain.
        payload_std: Relative standard deviation of the gain from what is uncertain of the payload.
        shown: Whether identification would give the gain.
    """

    joint: int = Field(ge=1)
    wanted: bool
    payload_torque_rms: float = Field(description="rms of the payload's part of the joint's torque [N m or N]")
    std: float | None = Field(description="predicted from the residual, as a share of the gain")
    payload_std: float | None
    shown: bool


class DesignedPayload(ResultModel):
    """A payload and what the joints see of it.

    Attributes:
        payload: With the keys of a payload file.
        joints: One entry a joint, in their order.
    """

    payload: dict[str, object]
    joints: list[DesignedJoint]


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints.

    Attributes:
        scenario: Its name.
        residual: Standard deviation of the residual that is expected, as a share of each joint's rms torque.
        flange: Frame of the model that the weight is mounted on, null where the last joint's axis stands for one.
        before: The scenario's own payload.
        after: The weight to make.
        candidates: The best weight of each shape, the best first and those that must not be mounted last.
    """

    scenario: str
    residual: float
    rated_load: float | None = Field(description="largest mass that the arm may carry, null if its file says none [kg]")
    own_is_better: bool = Field(description="whether the scenario's own payload shows the worst joint better")
    flange: str | None
    before: DesignedPayload
    after: DesignedPayload
    candidates: list[DesignedPayload]
