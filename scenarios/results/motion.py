"""Motion of the joints of a log, as a table and as a plot of their ranges."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from ident.diagnosis.motion_quality import JointMotion
from ident.model.arm import Arm
from scenarios.rendering.content import Table, column, percent, table
from scenarios.rendering.plot import TONES, Axis, Plot, Series, intervals
from scenarios.rendering.result import ResultModel


class CheckJoint(ResultModel):
    """Motion of a joint in a log."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    name: str = Field("", description="Name of the joint in the robot's model")
    unit: Literal["rad", "m"] = Field("rad", description="Unit of its positions")
    low: float = Field(description="Smallest position [rad or m]")
    high: float = Field(description="Largest position [rad or m]")
    limits: tuple[float, float] | None = Field(None, description="Range of the joint, null where the model has none")
    covered: float | None = Field(description="Share of the joint's range, null where the model has no limits")
    speed: float = Field(ge=0.0, description="Largest speed [rad/s or m/s]")
    speed_rms: float = Field(ge=0.0, description="Rms of the speed [rad/s or m/s]")
    acceleration_rms: float = Field(ge=0.0, description="Rms of the acceleration [rad/s^2 or m/s^2]")
    slow: float = Field(ge=0.0, le=1.0, description="Share of the time near reversals or at rest")
    current_rms: float = Field(ge=0.0, description="Rms of the current [drive units]")


class CheckLog(ResultModel):
    """A log; without joints if it cannot be filtered."""

    log: str = Field(description="Name of the log")
    joints: list[CheckJoint] = Field(description="One entry per joint, in order; empty if it cannot be filtered")

    @classmethod
    def of(cls, log: str, motions: Sequence[JointMotion], arm: Arm) -> "CheckLog":
        """Return the motion of an arm's joints."""
        limits = np.column_stack((arm.lower, arm.upper))
        return cls(
            log=log,
            joints=[
                CheckJoint(
                    joint=j + 1,
                    name=arm.joint_names[j],
                    unit="rad" if arm.revolute[j] else "m",
                    limits=(float(limits[j, 0]), float(limits[j, 1])) if np.isfinite(limits[j]).all() else None,
                    **asdict(each),
                )
                for j, each in enumerate(motions)
            ],
        )


def short_names(paths: Sequence[str]) -> tuple[str, ...]:
    """Return names of files without folders and endings, or unchanged if these are ambiguous."""
    stems = tuple(Path(path).stem for path in paths)
    return stems if len(set(stems)) == len(stems) else tuple(paths)


def motion_table(title: str, joints: Sequence[CheckJoint]) -> Table:
    """Return a table with one row per joint, not on a screen."""
    units = dict.fromkeys(each.unit for each in joints)
    place, speed, rate = (", ".join(f"{each}{per}" for each in units) for per in ("", "/s", "/s^2"))
    return table(
        joints,
        column("Joint", lambda each: each.joint),
        column("Name", lambda each: each.name, words=True),
        column(f"From [{place}]", lambda each: f"{np.round(each.low, 3):.3f}"),
        column(f"To [{place}]", lambda each: f"{np.round(each.high, 3):.3f}"),
        column("Of its range [%]", lambda each: percent(each.covered, ".0f")),
        column(f"Fastest [{speed}]", lambda each: f"{each.speed:#.3g}"),
        column(f"Rms acceleration [{rate}]", lambda each: f"{each.acceleration_rms:#.3g}"),
        column("Slow [% of time]", lambda each: percent(each.slow, ".0f")),
        column("Rms current [units]", lambda each: f"{each.current_rms:#.3g}"),
        title=title,
        file_only=True,
    )


def range_plot(logs: Mapping[str, Sequence[CheckJoint]]) -> Plot:
    """Return a plot of the share of each joint's range in every log; of positions if a range is unknown."""
    joints = next(iter(logs.values()))
    limits = [each.limits for each in joints]
    stated = all(each is not None for each in limits)
    ends = np.array([each if each and stated else (0.0, 100.0) for each in limits])  # (n, 2)
    unit = "% of range" if stated else ", ".join(dict.fromkeys(each.unit for each in joints))
    series: list[Series] = []
    for k, (name, motions) in enumerate(logs.items()):
        seen = np.array([[each.low, each.high] for each in motions])
        placed = 100.0 * (seen - ends[:, :1]) / np.diff(ends)  # (n, 2)
        about = [(0.5 * (low + high), low, high) for low, high in placed.tolist()]
        series.append(intervals(name, [str(each.joint) for each in motions], about, TONES[k % len(TONES)]))
    of = "as a share of the range that the model states" if stated else "as the model states no range for every joint"
    return Plot(
        title="Range of each joint",
        caption=f"From the lowest to the highest position of each joint, {of}.",
        x=Axis(title="joint", categories=tuple(str(each.joint) for each in joints)),
        y=Axis(title="position", unit=unit, zero=stated),
        series=tuple(series),
    )
