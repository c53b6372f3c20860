"""Joint torques as Parquet: `t`, and for each joint with a gain `tau1`, `tau1_low`, `tau1_high`."""

from pathlib import Path

from ident.estimation.joint_torque import JointTorque
from scenarios.experiments.gains_file import TURNING, GainsFile

DEVIATIONS = 2.0
"""Half-width of the interval of a torque, in standard deviations."""


def write_torque(found: JointTorque, file: GainsFile, path: Path) -> None:
    """Write torques; the schema's metadata names unit and interval.

    Raises:
        OSError: If it cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns, units = {"t": found.t}, {"t": "s"}
    for k, joint in enumerate(found.joints.tolist()):
        tau, reach = found.tau[:, k], DEVIATIONS * found.std[:, k]
        name, unit = f"tau{joint + 1}", "N m" if file.gains[joint].unit == TURNING else "N"
        for column, values in ((name, tau), (f"{name}_low", tau - reach), (f"{name}_high", tau + reach)):
            columns[column], units[column] = values, unit
    fields = [pa.field(name, pa.float64(), metadata={"unit": units[name]}) for name in columns]
    schema = pa.schema(fields, metadata={"interval": f"{DEVIATIONS:g} standard deviations of the drive gain"})
    pq.write_table(pa.table(list(columns.values()), schema=schema), path)
