"""How the joints of a recording moved, as a table and as a plot."""

from collections.abc import Mapping, Sequence

import numpy as np

from ident.model.arm import Arm
from scenarios.reports.content import Cell, Column, Table, cells, number, percent
from scenarios.reports.plot import TONES, Axis, Plot, Series, intervals
from scenarios.results.models.check import CheckJoint


def motion_table(title: str, motions: Sequence[CheckJoint], arm: Arm) -> Table:
    """A row a joint.

    Args:
        title: Of the table.
        motions: One a joint.
        arm: That moved.
    """
    rows = (_motion_row(j, arm.joint_names[j], motion) for j, motion in enumerate(motions))
    units = length_units(arm)
    columns = (
        Column(title="Joint"),
        Column(title="Name", words=True),
        Column(title="From", unit=", ".join(units)),
        Column(title="To", unit=", ".join(units)),
        Column(title="Of its range", unit="%"),
        Column(title="Fastest", unit=", ".join(f"{each}/s" for each in units)),
        Column(title="Rms acceleration", unit=", ".join(f"{each}/s^2" for each in units)),
        Column(title="Slow", unit="% of time"),
        Column(title="Rms current", unit="units"),
    )
    return Table(title=title, columns=columns, rows=tuple(rows))


def length_units(arm: Arm) -> list[str]:
    """Units of an arm's positions: of joints that turn, of joints that slide."""
    return [unit for unit, there in (("rad", arm.revolute.any()), ("m", not arm.revolute.all())) if there]


def coverage_plot(recorded: Mapping[str, Sequence[CheckJoint]], arm: Arm) -> Plot:
    """What of each joint's range every recording shows; positions themselves where the model states no range.

    Args:
        recorded: Motions of each joint, by the name of the recording.
        arm: That moved.
    """
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
        caption=f"From the lowest to the highest position of each joint, in shares of {of}.",
        x=Axis(title="joint", categories=names),
        y=Axis(title="position", unit=unit, zero=stated),
        series=tuple(series),
    )


def _motion_row(j: int, name: str, motion: CheckJoint) -> tuple[Cell, ...]:
    ends = (number(float(np.round(end, 3)), ".3f") for end in (motion.low, motion.high))
    return cells(
        str(j + 1),
        name,
        *ends,
        percent(motion.covered, ".0f"),
        f"{motion.speed:.3g}",
        f"{motion.acceleration_rms:.3g}",
        percent(motion.slow, ".0f"),
        f"{motion.current_rms:.3g}",
    )
