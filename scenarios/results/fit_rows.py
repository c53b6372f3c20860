"""The rows of a fit with time, position and speed, as data of its page.

They are saved with the result, so that a page needs no new identification.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ident.diagnosis.gain_symptoms import lag_one
from ident.diagnosis.motion_quality import joint_motions
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.problem import Problem
from ident.observation.observation import Observation
from ident.preparation import Prepared
from ident.recordings.formats.arrays import arrow_array
from ident.recordings.recording import Recording
from ident.support.arrays import Array, Indices
from ident.support.naming import one_line
from scenarios.results.motion import CheckLog
from scenarios.support.errors import ScenarioError

ROWS = "fit-rows.parquet"
"""Name that no recording can have: there, a hyphen precedes a number (`scenarios.experiments.schema`)."""
COLUMNS = {"t": "t", "stamp": "time", "V": "v", "residual": "residual", "q": "q", "dq": "dq"}
"""Columns of the file by the arrays of `FitRows`, in addition to `joint` and `motion`, both from 1."""
OF_JOINT = ("joint", "scale", "unit", "turning", "sigma", "still")
"""The other data of `FitRows`."""
ABOUT = b"rx90"
"""Key of the file's metadata with all other data, in JSON."""
GAP = 1.5
"""Rows farther apart than this number of periods are not connected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FitRows:
    """Rows of one joint, motions in sequence.

    Attributes:
        joint: The joint, from 0.
        scale: Factor from current to the plotted quantity: the gain, or 1 if refused.
        unit: Unit of the plotted quantity.
        turning: Whether the joint is revolute, otherwise prismatic.
        t: Time since the start of the first log, without pauses between logs [s], shape (r,).
        stamp: Time in the log at the middle of each row's filter [s], shape (r,).
        V: Currents [drive units], shape (r,).
        residual: Residuals [drive units], shape (r,).
        q, dq: Position and speed of the joint, shape (r,); empty if not plotted.
        motion: Number of each row's motion, shape (r,).
        sigma: Standard deviation of the residual [drive units].
        still: Time intervals near reversals whose samples are removed, start and end [s].
    """

    joint: int
    scale: float
    unit: str
    turning: bool
    t: Array
    stamp: Array
    V: Array
    residual: Array
    q: Array
    dq: Array
    motion: Indices
    sigma: float
    still: tuple[tuple[float, float], ...]

    def broken(self, values: Array) -> tuple[Array, Array]:
        """Return times and values for a line plot, with NaN where rows are removed or a motion ends."""
        step = np.diff(self.t)
        gaps = np.flatnonzero((step > GAP * np.median(step)) | (np.diff(self.motion) > 0)) + 1
        return np.insert(self.t, gaps, self.t[gaps] - 0.5 * step[gaps - 1]), np.insert(values, gaps, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """Rows of an estimate, for plots.

    Attributes:
        rows: Rows of each joint that has any.
        correlation: Autocorrelation of the residuals at lag 1, of the same joints.
        row_period: Time between rows [s].
        motions: Motion of the joints in each log, or in each part between gaps.
        begins: Start time of each motion on the time axis, and end of the last one [s].
    """

    rows: tuple[FitRows, ...]
    correlation: tuple[float, ...]
    row_period: float
    motions: tuple[CheckLog, ...]
    begins: tuple[float, ...]


def fit_of(prepared: Prepared, estimate: GainEstimate) -> Fit:
    """Return the rows of an estimate."""
    problem, all_rows = prepared.problem, estimate.solution.rows
    logs = [motion.recording for motion in prepared.motions]
    joints, arm = sorted(all_rows.unknowns), problem.structure.arm
    return Fit(
        rows=tuple(fit_rows(problem, estimate, joint, logs) for joint in joints),
        correlation=tuple(lag_one(all_rows, joint) for joint in joints),
        row_period=all_rows.row_period,
        motions=tuple(CheckLog.of(each.name, joint_motions(each, arm, prepared.observing), arm) for each in logs),
        begins=begins(logs),
    )


def write_fit(fit: Fit, folder: Path) -> None:
    """Write `ROWS`.

    Raises:
        OSError: If it cannot be written.
    """
    counts = [len(each.t) for each in fit.rows]
    columns: dict[str, Array | Indices] = {
        "joint": np.repeat([each.joint + 1 for each in fit.rows], counts),
        "motion": np.concatenate([each.motion + 1 for each in fit.rows]),
    }
    columns |= {name: np.concatenate([getattr(each, own) for each in fit.rows]) for own, name in COLUMNS.items()}
    about = {name: getattr(fit, name) for name in ("correlation", "row_period", "begins")}
    about["motions"] = [each.model_dump(mode="json") for each in fit.motions]
    about["rows"] = [{name: getattr(each, name) for name in OF_JOINT} for each in fit.rows]
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({name: arrow_array(each) for name, each in columns.items()})
    pq.write_table(table.replace_schema_metadata({ABOUT: json.dumps(about)}), folder / ROWS)


def read_fit(folder: Path) -> Fit:
    """Read `ROWS`.

    Raises:
        ScenarioError: If it is missing, or of another version.
    """
    path = folder / ROWS
    if not path.is_file():
        raise ScenarioError(f"{one_line(folder)}: holds no {ROWS}: written by an older version of rx90; save it again")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
        about = json.loads((table.schema.metadata or {})[ABOUT])
        columns = {name: table[name].to_numpy() for name in ("joint", "motion", *COLUMNS.values())}
        rows: list[FitRows] = []
        for each in about["rows"]:
            at = columns["joint"] == each["joint"] + 1
            arrays = {own: columns[name][at] for own, name in COLUMNS.items()}
            each["still"] = tuple((start, stop) for start, stop in each["still"])
            rows.append(FitRows(**each, motion=columns["motion"][at] - 1, **arrays))
        return Fit(
            rows=tuple(rows),
            correlation=tuple(about["correlation"]),
            row_period=about["row_period"],
            motions=tuple(map(CheckLog.model_validate, about["motions"])),
            begins=tuple(about["begins"]),
        )
    except (OSError, KeyError, TypeError, ValueError, pa.ArrowException) as error:
        first = one_line(" ".join(str(error).splitlines()[:2]))
        raise ScenarioError(f"{one_line(path)}: not rows of this version of rx90: {first}; save it again") from error


def fit_rows(problem: Problem, estimate: GainEstimate, joint: int, logs: Sequence[Recording]) -> FitRows:
    """Return the rows of a joint, from 0; `logs` are the logs of the motions."""
    rows, gain = estimate.solution.rows, estimate.joints[joint]
    own = rows.of(joint)
    turning = bool(problem.structure.arm.revolute[joint])
    known = isinstance(gain, IdentifiedGain)
    motion, stamp, still = rows.motion[own], np.empty(own.stop - own.start), list[tuple[float, float]]()
    first = np.array([log.t[0] for log in logs])
    later = np.array(begins(logs)[:-1]) - first  # time on the axis minus time in the log, (motions,)
    for k in np.unique(motion).tolist():
        seen, at = problem.motions[k].observation, motion == k
        observed = seen.joints[joint]
        stamp[at] = observed.t[np.searchsorted(observed.position, rows.position[own][at])]
        still += [(a + float(later[k]), b + float(later[k])) for a, b in _still(seen, joint)]
    q, dq = _states(problem, joint, motion, rows.position[own])
    return FitRows(
        joint=joint,
        scale=gain.value if known else 1.0,
        unit=("N m" if turning else "N") if known else "drive units",
        turning=turning,
        t=stamp + later[motion],
        stamp=stamp,
        V=rows.V[own],
        residual=rows.residual[own],
        q=q,
        dq=dq,
        motion=motion,
        sigma=rows.sigma(joint),
        still=tuple(still),
    )


def _states(problem: Problem, joint: int, motion: Indices, position: Indices) -> tuple[Array, Array]:
    """Return position and speed of a joint at the middle of its rows' filters, each of shape (r,)."""
    q, dq = np.empty(len(motion)), np.empty(len(motion))
    for k in np.unique(motion).tolist():
        behind, own = problem.motions[k].observation.full_rate, motion == k
        assert behind is not None, "asked of motions that were recorded"
        at = position[own] * behind.decimator.factor + len(behind.decimator.kernel) // 2
        q[own], dq[own] = behind.q[at, joint], behind.dq[at, joint]
    return q, dq


def begins(logs: Sequence[Recording]) -> tuple[float, ...]:
    """Return the start of each log if they follow each other, and the end of the last one [s]."""
    return tuple(np.cumsum([0.0, *(len(log.t) * log.period for log in logs)]).tolist())


def _still(seen: Observation, joint: int) -> list[tuple[float, float]]:
    """Return time intervals of a log whose samples are removed for a joint, start and end, in log time [s]."""
    behind, observed = seen.full_rate, seen.joints[joint]
    assert behind is not None, "asked of motions that were recorded"
    middle = 0.5 * (len(behind.decimator.kernel) - 1) * behind.period
    first = observed.t[0] - middle - observed.position[0] * observed.row_period  # of the filtered samples
    edges = np.flatnonzero(np.diff(np.concatenate(([True], behind.moving[:, joint], [True])).astype(int)))
    return [(first + a * behind.period, first + b * behind.period) for a, b in edges.reshape(-1, 2).tolist()]
