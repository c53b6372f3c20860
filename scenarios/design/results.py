"""Results of design commands: robot from a model, payload for a scenario, motion."""

import math

from pydantic import Field

from scenarios.support.result_model import ResultModel


class NewRobot(ResultModel):
    """What `rx90 new-robot --json` prints."""

    robot: str = Field(description="Name of the robot or scenario")
    joints: list[str] = Field(description="Names of the joints, in order")
    predicted_rel_std: list[float] = Field(
        description=(
            "Predicted relative standard deviation of each gain with the motion found, for residuals of 2 % of the "
            "torque"
        )
    )
    identifiable: list[bool] = Field(description="Whether the scenario that was written requires each joint's gain")
    files: list[str] = Field(description="Files that were written")
    held: list[str] = Field(
        description="Joints recognised as those of a gripper and locked at their initial positions in the model"
    )
    payload_mass: float = Field(description="Mass of the scenario's payload [kg]")
    payload_source: str = Field(description="Origin of the payload")
    payload_warning: str | None = Field(description="Why it may be too heavy, null if nothing suggests it")


class DesignedJoint(ResultModel):
    """Effect of a payload on a joint."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    wanted: bool = Field(description="Whether the payload is designed to identify its gain")
    payload_torque_rms: float = Field(description="Rms of the joint torque that the payload causes [N m or N]")
    std: float | None = Field(description="Relative standard deviation of the gain that is predicted from the residual")
    payload_std: float | None = Field(
        description="Relative standard deviation of the gain from the uncertainty of the payload"
    )
    shown: bool = Field(description="Whether the gain is expected to be identifiable")


class DesignedPayload(ResultModel):
    """A payload and its effect on the joints."""

    payload: dict[str, object] = Field(description="The payload, with the keys of a payload file")
    joints: list[DesignedJoint] = Field(description="One entry per joint, in order")


class _Shape(ResultModel):
    shape: str = Field(description="Name of the shape")
    dimensions_mm: dict[str, float] = Field(description="Dimensions by name [mm]")
    turned_deg: int = Field(description="Angle about the flange's axis [degrees]")
    density: float = Field(description="Density of the material [kg/m^3]")
    refusal: str | None = Field(description="Why the payload must not be mounted, null if it may be")


class DesignedWeight(DesignedPayload, _Shape):
    """A designed payload and its effect on the joints."""


class PayloadDesign(ResultModel):
    """What `rx90 payload --json` prints."""

    scenario: str = Field(description="Name of the robot or scenario")
    residual: float = Field(
        description="Expected standard deviation of the residual, as a share of each joint's rms torque"
    )
    rated_load: float | None = Field(description="Rated load of the arm, null if its file does not state one [kg]")
    own_is_better: bool = Field(description="Whether the scenario's own payload identifies the worst joint better")
    flange: str | None = Field(
        description="Frame of the model on which the payload is mounted, null for the axis of the last joint"
    )
    before: DesignedPayload = Field(description="The scenario's own payload")
    after: DesignedPayload = Field(description="The payload to be manufactured")
    candidates: list[DesignedWeight] = Field(
        description="The best payload of each shape: the best first, those that must not be mounted last"
    )


class Recorded(ResultModel):
    """What `rx90 record --json` prints; arrays have one number per joint."""

    files: list[str] = Field(description="Files that were written")
    kept: list[str] = Field(description="Existing payload files that differ from the scenario's payloads")
    samples: int = Field(description="Number of samples of the motion")
    duration_s: float = Field(description="Time from the first to the last sample [s]")
    start: list[float] = Field(description="First position of each joint [rad or m]")
    max_velocity: list[float] = Field(description="Largest speed of each joint [rad/s or m/s]")
    max_acceleration: list[float] = Field(description="Largest acceleration of each joint [rad/s^2 or m/s^2]")
    beyond_limits: list[str] = Field(
        description="Limits of the arm that the motion exceeds, in words, one entry per joint and limit"
    )


class Searched(ResultModel):
    """What `rx90 excite --json` prints."""

    out: str = Field(description="The motion file that was written")
    tried: int = Field(description="Number of motions")
    cost_of_start: float = Field(description="Cost of the initial motion of the search, a sum of logarithms as `cost`")
    cost: float = Field(
        description=(
            "Cost that the search minimises: a sum of logarithms of the relative standard deviations of the gains to "
            "identify, dominated by the largest, plus a penalty for exceeded limits"
        )
    )
    predicted_rel_std: list[float | None] = Field(
        description="Relative standard deviation of each gain, null if the motion does not determine the gain"
    )


def finite(value: float) -> float | None:
    """Return the value, None if not finite."""
    return float(value) if math.isfinite(value) else None
