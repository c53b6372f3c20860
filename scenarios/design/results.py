"""What commands that design print: a robot begun from its model, a weight made for a scenario, a motion."""

import math

from pydantic import Field

from scenarios.support.result_model import ResultModel


class NewRobot(ResultModel):
    """What `rx90 new-robot --json` prints."""

    robot: str = Field(description="Its name")
    joints: list[str] = Field(description="Names of the joints in their order")
    predicted_rel_std: list[float] = Field(
        description=(
            "Predicted relative standard deviation of each gain with the motion found, for residuals of 2 % of the "
            "torque"
        )
    )
    identifiable: list[bool] = Field(description="Whether the scenario that was written requires each joint's gain")
    files: list[str] = Field(description="That were written")
    held: list[str] = Field(
        description="Joints taken for those of a gripper, locked at their initial positions in the model"
    )
    payload_mass: float = Field(description="Of what the scenario mounts [kg]")
    payload_source: str = Field(description="Where the payload comes from")
    payload_warning: str | None = Field(description="Why it may be too heavy, null if nothing suggests it")


class DesignedJoint(ResultModel):
    """What a joint sees of a payload."""

    joint: int = Field(ge=1, description="Its number, from 1")
    wanted: bool = Field(description="Whether the payload is designed to identify its gain")
    payload_torque_rms: float = Field(description="rms of the payload's part of the joint's torque [N m or N]")
    std: float | None = Field(description="predicted from the residual, as a share of the gain")
    payload_std: float | None = Field(
        description="Relative standard deviation of the gain from the uncertainty of the payload"
    )
    shown: bool = Field(description="Whether identification would give the gain")


class DesignedPayload(ResultModel):
    """A payload and what the joints see of it."""

    payload: dict[str, object] = Field(description="With the keys of a payload file")
    joints: list[DesignedJoint] = Field(description="One entry per joint, in their order")


class _Shape(ResultModel):
    shape: str = Field(description="its name")
    dimensions_mm: dict[str, float] = Field(description="by their names [mm]")
    turned_deg: int = Field(description="about the flange's axis [degrees]")
    density: float = Field(description="of the material [kg/m^3]")
    refusal: str | None = Field(description="why it must not be mounted, null if it may be")


class DesignedWeight(DesignedPayload, _Shape):
    """A weight that could be made, and what the joints see of it."""


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints."""

    scenario: str = Field(description="Its name")
    residual: float = Field(
        description="Standard deviation of the residual that is expected, as a share of each joint's rms torque"
    )
    rated_load: float | None = Field(description="largest mass that the arm may carry, null if its file says none [kg]")
    own_is_better: bool = Field(description="whether the scenario's own payload identifies the worst joint better")
    flange: str | None = Field(
        description="Frame of the model that the payload is mounted on, null where it is the last joint's axis"
    )
    before: DesignedPayload = Field(description="The scenario's own payload")
    after: DesignedPayload = Field(description="The payload to make")
    candidates: list[DesignedWeight] = Field(
        description="The best payload of each shape, the best first and those that must not be mounted last"
    )


class Sampled(ResultModel):
    """What `rx90 trajectory --json` prints; a number a joint."""

    out: str = Field(description="The file that was written")
    format: str = Field(description="Its format, as --as names it")
    samples: int = Field(description="Number of samples")
    duration_s: float = Field(description="Time of the last sample, the first being at 0 [s]")
    start: list[float] = Field(description="first position of each joint [rad or m]")
    max_velocity: list[float] = Field(description="largest speed of each joint [rad/s or m/s]")
    max_acceleration: list[float] = Field(description="largest acceleration of each joint [rad/s^2 or m/s^2]")
    beyond_limits: list[str] = Field(
        description="Limits of the arm that the motion exceeds, in words, one entry per joint and limit"
    )


class Searched(ResultModel):
    """What `rx90 excite --json` prints."""

    out: str = Field(description="The motion file that was written")
    tried: int = Field(description="Number of motions")
    cost_of_start: float = Field(description="Cost of the motion that the search began with, of logarithms as `cost`")
    cost: float = Field(
        description=(
            "Cost that the search minimises: logarithms of the relative standard deviations of the gains to identify, "
            "mostly of the worst, and a penalty on limits that the motion exceeds"
        )
    )
    predicted_rel_std: list[float | None] = Field(
        description="relative standard deviation of each gain, null where the motion does not determine it"
    )


def finite(value: float) -> float | None:
    """The value, None where there is none."""
    return float(value) if math.isfinite(value) else None
