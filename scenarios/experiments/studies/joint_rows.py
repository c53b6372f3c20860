"""The rows of a study, joint by joint, reduced to the data that statistics and figures need.

Parts are read one at a time, so a study needs memory for three numbers per trial and joint with a gain.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from ident.support.arrays import Array

if TYPE_CHECKING:
    from scenarios.experiments.studies.folder import StudyFolder

SHOWN = 5000
"""Least number of injected gains kept per joint (if available); figures show no more points."""
COLUMNS = ("joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that statistics and figures need."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """One joint in all trials of a study.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials.
        failed: Number of trials without any estimate.
        passed: Trials that passed.
        tolerance: Largest relative error that passes, of the first trial.
        rel_error: Relative errors of the trials that gave a gain, shape (K,), as the following arrays.
        claimed: Estimated relative standard deviations.
        z: Errors over estimated standard deviations; NaN if there is none.
        step: The injected gain of every `step`-th of these trials is kept.
        true: Injected gains of every `step`-th trial [N m / drive unit], shape (ceil(K / step),).
    """

    joint: int
    trials: int
    failed: int
    passed: int
    tolerance: float
    rel_error: Array
    claimed: Array
    z: Array
    step: int
    true: Array

    @property
    def gains(self) -> int:
        """Number of trials that gave a gain."""
        return len(self.rel_error)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study.

    Attributes:
        joints: One entry per joint, in order.
        failures: Trials without any estimate by kind, the most frequent first.
    """

    joints: tuple[JointRows, ...]
    failures: Mapping[str, int]


def rows_in(folder: "StudyFolder") -> StudyRows:
    """Gather the rows of a study's folder.

    Raises:
        StudyError: If a part cannot be read.
    """
    parts = folder.parts()
    return study_rows((folder.rows(part, COLUMNS) for part in parts), trials=sum(len(part.trials) for part in parts))


def study_rows(tables: Iterable[pa.Table], *, trials: int) -> StudyRows:
    """Gather the rows of a study.

    `tables` have one row per trial and joint, in any order and division, with `COLUMNS`.
    """
    gathered: dict[int, _Gathered] = {}
    step = max(1, trials // SHOWN)
    for table in tables:
        joint, failure = table["joint"].to_numpy(), table["failure"]
        identifiable, passed = (pc.fill_null(table[name], False).to_numpy() for name in ("identifiable", "passed"))
        true, std, error, z = (table[name].to_numpy() for name in ("true", "std", "rel_error", "z"))
        numbers = np.stack([error, std / np.abs(true), z])
        for number in np.unique(joint).tolist():
            rows = np.flatnonzero(joint == number)
            if number not in gathered:
                gathered[number] = _Gathered(table["tolerance"][rows[0]].as_py(), np.empty((3, trials)), step)
            known, found = gathered[number], rows[identifiable[rows]]
            known.trials += len(rows)
            known.passed += int(np.count_nonzero(passed[rows]))
            known.failures.update(failure.take(rows).drop_null().to_pylist())
            known.add(numbers[:, found], true[found])
    joints = tuple(gathered[number].joint_rows(number) for number in sorted(gathered))
    return StudyRows(joints=joints, failures=dict(gathered[joints[0].joint].failures.most_common()) if joints else {})


@dataclass(slots=True, eq=False)
class _Gathered:
    """Accumulated data of one joint.

    The array of shape (3, trials) is allocated at the start: unwritten memory costs nothing, while growing an array
    needs a copy.
    """

    tolerance: float
    numbers: Array
    step: int
    trials: int = 0
    gains: int = 0
    passed: int = 0
    true: list[Array] = field(default_factory=list[Array])
    failures: Counter[str] = field(default_factory=Counter[str])

    def add(self, numbers: Array, true: Array) -> None:
        """Add trials with a gain: their numbers, shape (3, k), and injected gains, shape (k,)."""
        self.true.append(true[-self.gains % self.step :: self.step].copy())  # a copy, not a view that keeps all of them
        self.numbers[:, self.gains : self.gains + len(true)] = numbers
        self.gains += len(true)

    def joint_rows(self, joint: int) -> JointRows:
        """Return the complete data."""
        rel_error, claimed, z = self.numbers[:, : self.gains]
        return JointRows(
            joint=joint,
            trials=self.trials,
            failed=self.failures.total(),
            passed=self.passed,
            tolerance=self.tolerance,
            rel_error=rel_error,
            claimed=claimed,
            z=z,
            step=self.step,
            true=np.concatenate(self.true),
        )
