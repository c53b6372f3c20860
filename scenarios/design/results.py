"""Results of design commands: robot from a model, payload for a scenario, motion."""

import math

from pydantic import Field

from scenarios.rendering.result import ResultModel


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
