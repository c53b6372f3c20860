"""Comparison of motors with joint torque sensors: sensor = slope * motor + Fv dq + Fc sign(dq) + offset."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.estimation.gain_options import GainOptions
from ident.numerics.least_squares import least_squares
from ident.support.errors import IdentificationError
from ident.support.naming import nearest, one_line
from scenarios.benchmark.scoreboard.recipes import SensorTable
from scenarios.benchmark.scoreboard.results import SensorGain
from scenarios.support.errors import ScenarioError


def sensor_gains(path: Path, table: SensorTable) -> list[SensorGain]:
    """Return the slope of every sensor over its motor, by least squares of all rows.

    Raises:
        ScenarioError: If the file is not Parquet, or lacks a column.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        known = pq.read_schema(path).names
    except (OSError, pa.ArrowException) as error:
        raise ScenarioError(f"{one_line(path)}: not Parquet: {one_line(error)}") from error
    patterns = (table.motor, table.velocity, *table.sensors)
    names = [each.format(j=j) for j in range(1, table.joints + 1) for each in patterns]
    lacking = next((name for name in names if name not in known), None)
    if lacking is not None:
        raise ScenarioError(f"{one_line(path)}: no column {lacking}{nearest(lacking, known)}")
    columns = pq.read_table(path, columns=names)
    values = {name: np.asarray(columns[name].to_numpy(), dtype=np.float64) for name in names}
    return [_slope(values, table, j, sensor) for j in range(1, table.joints + 1) for sensor in table.sensors]


def disagreements(found: Sequence[SensorGain]) -> list[str]:
    """Return a sentence for each pair of sensors of one joint that differ by more than two standard deviations."""
    said = list[str]()
    for A, B in combinations(found, 2):
        if A.joint != B.joint or A.slope is None or B.slope is None or A.std is None or B.std is None:
            continue
        if abs(A.slope - B.slope) > 2.0 * np.hypot(A.std, B.std):
            off = two_digits(100.0 * (B.slope / A.slope - 1.0), sign="+")
            said.append(
                f"joint {A.joint}: {B.sensor} differs from {A.sensor} by {off} %; at most one can be its torque"
            )
    return said


def _slope(values: dict[str, np.ndarray], table: SensorTable, j: int, sensor: str) -> SensorGain:
    motor, dq, torque = (values[each.format(j=j)] for each in (table.motor, table.velocity, sensor))
    finite = np.isfinite(motor) & np.isfinite(dq) & np.isfinite(torque)
    motor, dq, torque = motor[finite], dq[finite], torque[finite]
    W = np.column_stack((motor, dq, np.sign(dq), np.ones(len(dq))))
    name = sensor.format(j=j)
    try:
        fit = least_squares(W, torque, rank_tol=1e-7)
    except IdentificationError:
        return SensorGain(joint=j, sensor=name, slope=None, std=None, rel_error=None)
    sure = float(fit.std[0]) <= GainOptions().max_rel_std * abs(float(fit.x[0]))
    return SensorGain(
        joint=j,
        sensor=name,
        slope=float(fit.x[0]) if sure else None,
        std=float(fit.std[0]) if sure else None,
        rel_error=float(np.linalg.norm(fit.residual) / np.linalg.norm(torque)),
    )
