"""Rows of a fit with time, position and speed, saved with the result; plots of their torques on its page."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ident.diagnosis.motion_quality import joint_motions
from ident.estimation.estimate import GainEstimate
from ident.estimation.problem import Problem
from ident.preparation import Prepared
from ident.recordings.formats.arrays import arrow_array
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices
from ident.support.naming import one_line
from scenarios.rendering.plot import COLOURS, LIMIT, Plot
from scenarios.results.check import CheckLog
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROWS = "fit-rows.parquet"
"""Name that no recording can have: there, a hyphen precedes a number (`scenarios.experiments.schema`)."""
COLUMNS = ("t", "time", "v", "residual", "q", "dq")
ABOUT = b"rx90"
"""Key of the file's metadata with all other data, in JSON."""
GAP = 1.5
"""Rows farther apart than this number of periods are not connected."""
MOST = 1600
"""Largest number of points of a line, more than the pixels of a screen."""
TORQUES = (
    "Gain times current, filtered and decimated as for the fit, and its reconstruction by the fitted model, motions "
    "in sequence. Below: the residual, on a separate scale."
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """Rows of an estimate, for plots."""

    joint: Indices  # number of each row's joint, from 1, shape (r,); joint after joint
    motion: Indices  # number of each row's motion, from 1, shape (r,)
    rows: Mapping[str, Array]  # `COLUMNS` of the rows, shape (r,)
    still: Mapping[int, Sequence[tuple[float, float]]]  # intervals near reversals without rows [s], by joint
    motions: tuple[CheckLog, ...]  # of the joints in each log, or part between gaps
    begins: tuple[float, ...]  # start of each motion, end of the last one [s]


def fit_of(prepared: Prepared, estimate: GainEstimate) -> Fit:
    """Return the rows of an estimate."""
    arm, logs = prepared.problem.structure.arm, [motion.recording for motion in prepared.motions]
    joints = sorted(estimate.solution.rows.unknowns)
    motions, rows, still = zip(*(fit_rows(prepared.problem, estimate, joint, logs) for joint in joints), strict=True)
    return Fit(
        joint=np.repeat(np.array(joints) + 1, list(map(len, motions))),
        motion=np.concatenate(motions) + 1,
        rows={name: np.concatenate([own[name] for own in rows]) for name in COLUMNS},
        still={joint + 1: own for joint, own in zip(joints, still, strict=True)},
        motions=tuple(CheckLog.of(each.name, joint_motions(each, arm, prepared.observing), arm) for each in logs),
        begins=begins(logs),
    )


def fit_rows(
    problem: Problem, estimate: GainEstimate, joint: int, logs: Sequence[Recording]
) -> tuple[Indices, dict[str, Array], list[tuple[float, float]]]:
    """Return motions (from 0), columns and removed intervals of a joint, from 0; `logs` are the logs of the motions."""
    rows = estimate.solution.rows
    own = rows.of(joint)
    motion, position, still = rows.motion[own], rows.position[own], list[tuple[float, float]]()
    later = np.array(begins(logs)[:-1]) - [log.t[0] for log in logs]  # time on the axis minus time in the log
    stamp, q, dq = np.empty((3, len(motion)))
    for k in np.unique(motion).tolist():
        seen, at = problem.motions[k].observation, motion == k
        behind, observed = seen.full_rate, seen.joints[joint]
        assert behind is not None, "asked of motions that were recorded"
        half, period = len(behind.decimator.kernel) // 2, behind.period
        stamp[at] = observed.t[np.searchsorted(observed.position, position[at])]
        middle = position[at] * behind.decimator.factor + half
        q[at], dq[at] = behind.q[middle, joint], behind.dq[middle, joint]
        # start of the filtered samples on the axis: the first row is at the middle of its filter
        first = observed.t[0] - 0.5 * (len(behind.decimator.kernel) - 1) * period + later[k]
        first -= observed.position[0] * observed.row_period
        edges = np.flatnonzero(np.diff(np.concatenate(([True], behind.moving[:, joint], [True])).astype(int)))
        still += [(float(first + a * period), float(first + b * period)) for a, b in edges.reshape(-1, 2)]
    columns = (stamp + later[motion], stamp, rows.V[own], rows.residual[own], q, dq)
    return motion, dict(zip(COLUMNS, columns, strict=True)), still


def begins(logs: Sequence[Recording]) -> tuple[float, ...]:
    """Return the start of each log if they follow each other, and the end of the last one [s]."""
    return tuple(np.cumsum([0.0, *(len(log.t) * log.period for log in logs)]).tolist())


def write_fit(fit: Fit, folder: Path) -> None:
    """Write `ROWS`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    motions = [each.model_dump(mode="json") for each in fit.motions]
    about = json.dumps({"begins": fit.begins, "motions": motions, "still": fit.still})
    columns = {"joint": fit.joint, "motion": fit.motion, **fit.rows}
    table = pa.table({name: arrow_array(each) for name, each in columns.items()})
    pq.write_table(table.replace_schema_metadata({ABOUT: about}), folder / ROWS)


def read_fit(folder: Path) -> Fit:
    """Read `ROWS`; raises `ScenarioError` if it is missing, or of another version."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = folder / ROWS
    try:
        table = pq.read_table(path)
        about = json.loads((table.schema.metadata or {})[ABOUT])
        return Fit(
            joint=table["joint"].to_numpy(),
            motion=table["motion"].to_numpy(),
            rows={name: table[name].to_numpy() for name in COLUMNS},
            still={int(joint): [(start, stop) for start, stop in own] for joint, own in about["still"].items()},
            motions=tuple(map(CheckLog.model_validate, about["motions"])),
            begins=tuple(about["begins"]),
        )
    except (OSError, KeyError, TypeError, ValueError, AttributeError, pa.ArrowException) as error:
        first = one_line(" ".join(str(error).splitlines()[:2]))
        raise ScenarioError(f"{one_line(path)}: not rows of this version of rx90: {first}; save it again") from error


def torque_plot(
    joint: int,
    unit: str,
    t: Array,
    measured: Array,
    residual: Array,
    motion: Indices,
    starts: Sequence[tuple[str, float]],
    still: Sequence[tuple[float, float]] = (),
) -> Plot:
    """Return the plot of a joint, from 0; lines break where rows are removed or a motion ends; arrays (r,)."""
    intervals = np.diff(t)
    gaps = np.flatnonzero((intervals > GAP * np.median(intervals)) | (np.diff(motion) > 0)) + 1
    step, refused = -(-len(t) // MOST), unit == "drive units"
    at = np.insert(t, gaps, t[gaps] - 0.5 * intervals[gaps - 1])
    empty = np.isnan(np.insert(t, gaps, np.nan))
    keep = np.sort(np.r_[np.flatnonzero(empty), np.flatnonzero(~empty)[::step]])

    def draw(above: "Axes", below: "Axes") -> None:
        for k, (start, stop) in enumerate(still):
            label = "Near a reversal (excluded)" if k == 0 else None
            above.axvspan(start, stop, color=COLOURS["band"], lw=0.0, zorder=0.5, label=label)
        lines = (above, "Measured", measured), (above, "Reconstructed", measured - residual), (below, None, residual)
        for axes, label, values in lines:
            axes.plot(at[keep], np.insert(values, gaps, np.nan)[keep], label=label)
        for name, start in starts:
            above.axvline(start, **LIMIT)
            place: Any = {"xycoords": ("data", "axes fraction"), "xytext": (3, -3), "textcoords": "offset points"}
            above.annotate(name, (start, 1.0), va="top", fontsize=9.0, in_layout=False, **place)
        below.axhline(0.0, **LIMIT)
        below.set_ylabel(f"Residual\n[{'units' if refused else unit}]")

    share = f"{100.0 * float(np.linalg.norm(residual) / np.linalg.norm(measured)):.2g} %"
    what = "Current (the gain is refused)" if refused else "Gain times current"
    every = "every row" if step == 1 else f"one row in {step}"
    caption = f"{what}; residual {share} of its rms. Shown: {every} of {len(t)}."
    quantity = {"N m": "Torque", "N": "Force"}.get(unit, "Current")
    title, y = f"Joint {joint + 1}", f"{quantity} [{unit}]"
    return Plot(title=title, caption=caption, x="Time [s]", y=y, draw=draw, wide=True, heights=(170, 50))
