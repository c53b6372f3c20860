"""Motion of the joints of a recording, as a table and as a plot."""

from collections.abc import Mapping, Sequence

import numpy as np

from ident.model.arm import Arm
from scenarios.reports.content import Table, column, percent, table
from scenarios.reports.plot import TONES, Axis, Plot, Series, intervals
from scenarios.results.models.check import CheckJoint


def motion_table(title: str, motions: Sequence[CheckJoint], arm: Arm) -> Table:
    """Return a table with one row per joint."""
    place, speed, rate = (", ".join(f"{each}{per}" for each in length_units(arm)) for per in ("", "/s", "/s^2"))
    return table(
        list(zip(arm.joint_names, motions, strict=True)),
        column("Joint", lambda row: row[1].joint),
        column("Name", lambda row: row[0], words=True),
        column(f"From [{place}]", lambda row: f"{np.round(row[1].low, 3):.3f}"),
        column(f"To [{place}]", lambda row: f"{np.round(row[1].high, 3):.3f}"),
        column("Of its range [%]", lambda row: percent(row[1].covered, ".0f")),
        column(f"Fastest [{speed}]", lambda row: f"{row[1].speed:#.3g}"),
        column(f"Rms acceleration [{rate}]", lambda row: f"{row[1].acceleration_rms:#.3g}"),
        column("Slow [% of time]", lambda row: percent(row[1].slow, ".0f")),
        column("Rms current [units]", lambda row: f"{row[1].current_rms:#.3g}"),
        title=title,
    )


def length_units(arm: Arm) -> list[str]:
    """Return the units of an arm's positions: of revolute and of prismatic joints."""
    return [unit for unit, there in (("rad", arm.revolute.any()), ("m", not arm.revolute.all())) if there]


def coverage_plot(recorded: Mapping[str, Sequence[CheckJoint]], arm: Arm) -> Plot:
    """Return a plot of the share of each joint's range in every recording; of positions without a range."""
    span = arm.upper - arm.lower
    stated = bool(np.isfinite(span).all())
    low, unit = (arm.lower, "% of range") if stated else (np.zeros(arm.n), ", ".join(length_units(arm)))
    size = span / 100.0 if stated else np.ones(arm.n)
    names = tuple(f"{j + 1}" for j in range(arm.n))
    series: list[Series] = []
    for k, (name, motions) in enumerate(recorded.items()):
        ends = np.array([[each.low, each.high] for each in motions])
        placed = (ends - low[:, None]) / size[:, None]  # (n, 2)
        seen = [(0.5 * (a + b), a, b) for a, b in placed.tolist()]
        series.append(intervals(name, names, seen, TONES[k % len(TONES)]))
    of = "the range that the model states" if stated else "no range: the model states none"
    return Plot(
        title="Range of each joint",
        caption=f"From the lowest to the highest position of each joint, as a share of {of}.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="position", unit=unit, zero=stated),
        series=tuple(series),
    )
