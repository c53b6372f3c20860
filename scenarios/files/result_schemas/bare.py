"""JSON Schema of what bare motions alone say of gains."""

from pydantic import Field

from scenarios.files.result_schemas.open_object import OpenObject


class BareParameter(OpenObject):
    """A parameter that bare motions show.

    Attributes:
        parameter: Its name as in the literature, numbered by joint; several where only their sum shows.
        unit: Of its numbers.
        estimate: What was found, in `unit`.
        std: One standard deviation, that of the gains included where they are given, in `unit`.
    """

    parameter: str
    unit: str
    estimate: float
    std: float


class BareJoint(OpenObject):
    """A joint's gain over that of the reference joint, and its friction in drive units.

    Attributes:
        joint: Its number, from 1.
        name: Of the joint in the robot's model.
        ratio: Ratio of its gain to that of the reference joint, null where the motions do not show it.
        rel_std: Relative standard deviation of the ratio, 0 for the reference joint; null with the ratio.
        off_std: Standard deviation of `off`, a share too, that of the given gains included.
        friction: Friction and offset of the joint.
    """

    joint: int = Field(ge=1)
    name: str
    ratio: float | None
    rel_std: float | None
    off: float | None = Field(description="share by which given gains contradict the ratio")
    off_std: float | None
    friction: list[BareParameter]


class BareResult(OpenObject):
    """What `rx90 identify --json` prints of bare recordings alone.

    Attributes:
        reference: Number, from 1, of the joint beside which the others are surest.
        joints: One entry a joint, in their order.
        base_parameters: Of the arm, over the gain of the reference joint.
        base_parameters_si: The same with gains that are given, null without any.
        notes: What the method chose and what one should know.
    """

    reference: int = Field(ge=1)
    joints: list[BareJoint]
    base_parameters: list[BareParameter]
    base_parameters_si: list[BareParameter] | None
    notes: list[str]
