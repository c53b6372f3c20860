"""What commands that design print: a robot begun from its model, a weight made for a scenario, a motion."""

import math

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
        held: Joints that are taken for a gripper's, and held where they are drawn.
        payload_mass: Of what the scenario mounts [kg].
        payload_source: Where the payload comes from.
        payload_warning: What speaks against it, null if nothing does.
    """

    robot: str
    joints: list[str]
    predicted_rel_std: list[float]
    identifiable: list[bool]
    files: list[str]
    held: list[str]
    payload_mass: float
    payload_source: str
    payload_warning: str | None


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


class _Shape(ResultModel):
    shape: str = Field(description="its name")
    dimensions_mm: dict[str, float] = Field(description="by their names [mm]")
    turned_deg: int = Field(description="about the flange's axis [degrees]")
    density: float = Field(description="of the material [kg/m^3]")
    refusal: str | None = Field(description="why it must not be mounted, null if it may be")


class DesignedWeight(DesignedPayload, _Shape):
    """A weight that could be made, and what the joints see of it."""


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
    own_is_better: bool = Field(description="whether the scenario's own payload identifies the worst joint better")
    flange: str | None
    before: DesignedPayload
    after: DesignedPayload
    candidates: list[DesignedWeight]


class Sampled(ResultModel):
    """What `rx90 trajectory --json` prints; a number a joint.

    Attributes:
        out: The file that was written.
        format: Its form, as --format names it.
        samples: Times that each joint has a position for.
        duration_s: Time of the last sample, the first being at 0 [s].
        beyond_limits: Limits of the arm that the motion breaks, in words, a joint and limit each.
    """

    out: str
    format: str
    samples: int
    duration_s: float
    start: list[float] = Field(description="first position of each joint [rad or m]")
    max_velocity: list[float] = Field(description="largest speed of each joint [rad/s or m/s]")
    max_acceleration: list[float] = Field(description="largest acceleration of each joint [rad/s^2 or m/s^2]")
    beyond_limits: list[str]


class Searched(ResultModel):
    """What `rx90 excite --json` prints.

    Attributes:
        out: The motion file that was written.
        cost_of_start: The `cost`, of logarithms too, of the motion that the search began with.
        cost: What the search makes small: logarithms of the wanted gains' relative deviations, mostly of the worst, and
            a penalty on limits that the motion exceeds. A lower one is better.
    """

    out: str
    tried: int = Field(description="motions")
    cost_of_start: float
    cost: float
    predicted_rel_std: list[float | None] = Field(
        description="relative standard deviation of each gain, null where the motion does not determine it"
    )


def finite(value: float) -> float | None:
    """The value, None where there is none."""
    return float(value) if math.isfinite(value) else None
