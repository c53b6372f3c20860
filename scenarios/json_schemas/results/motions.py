"""JSON Schema of motions that were converted, sampled or searched."""

from pydantic import Field

from scenarios.support.result_model import ResultModel


class Converted(ResultModel):
    """What `rx90 convert --json` prints.

    Attributes:
        out: The recording that was written.
        samples: Of the recording.
        joints: How many it has.
        duration_s: From the first sample to the last [s].
        rate_hz: One over the mean time between samples [Hz].
        notes: What was taken for granted, and what one should know.
    """

    out: str
    layout: str | None = Field(description="of logs that are recognised or named, null where their columns are said")
    signal: str | None = Field(description="what v was said to be")
    v: str | None = Field(description="what v of the recording is")
    samples: int
    joints: int
    duration_s: float
    rate_hz: float
    columns: dict[str, str | list[str]] = Field(description="of the log, that were taken for t, q and v")
    notes: list[str]


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
        description="relative standard deviation of each gain, null where the motion does not show it"
    )
