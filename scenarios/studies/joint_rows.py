"""The rows of a study, joint by joint: what its statistics and pictures need of a million trials, and no more.

Rows are taken a part at a time and dropped, so that a study costs four numbers a trial and joint with a gain, not a
table of everything.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from ident.arrays import Array
from scenarios.store.study_folder import StudyFolder

NUMBERS = ("true", "std", "rel_error", "z")
COLUMNS = ("joint", *NUMBERS, "identifiable", "passed", "failure", "tolerance")
"""Columns of a study that its statistics and pictures need."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """One joint in all trials of a study.

    Attributes:
        joint: Joint number, from 1.
        trials: Trials.
        failed: Trials without any estimate.
        passed: Trials that passed.
        tolerance: Of the relative error, in the first trial.
        true: Injected gains of the trials that gave one [N m / drive unit], shape (K,); so are the others.
        std: Claimed standard deviations [N m / drive unit].
        rel_error: Relative errors.
        z: Errors over claimed deviations; NaN where there is none.
    """

    joint: int
    trials: int
    failed: int
    passed: int
    tolerance: float
    true: Array
    std: Array
    rel_error: Array
    z: Array

    @property
    def gains(self) -> int:
        """Trials that gave a gain."""
        return len(self.rel_error)

    @property
    def claimed(self) -> Array:
        """Claimed relative standard deviations, shape (K,)."""
        magnitude = np.abs(self.true)
        return np.divide(self.std, magnitude, out=magnitude)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study.

    Attributes:
        joints: One a joint, in their order.
        failures: Trials without any estimate by kind, the most frequent first.
    """

    joints: tuple[JointRows, ...]
    failures: Mapping[str, int]


def rows_in(folder: StudyFolder) -> StudyRows:
    """Gather the rows of a study's folder.

    Raises:
        DamagedFolder: If a part cannot be read.
    """
    parts = folder.parts()
    return study_rows((folder.rows(part, COLUMNS) for part in parts), trials=sum(len(part.trials) for part in parts))


def study_rows(tables: Iterable[pa.Table], *, trials: int) -> StudyRows:
    """Gather the rows of a study.

    Args:
        tables: A row a trial and joint, in any order and any cut, with `COLUMNS`.
        trials: That they have, at most.
    """
    gathered: dict[int, _Gathered] = {}
    for table in tables:
        joint, failure = table["joint"].to_numpy(), table["failure"]
        identifiable, passed = (pc.fill_null(table[name], False).to_numpy() for name in ("identifiable", "passed"))
        tolerance, numbers = table["tolerance"], [table[name].to_numpy() for name in NUMBERS]
        for number in np.unique(joint).tolist():
            rows = np.flatnonzero(joint == number)
            if number not in gathered:
                gathered[number] = _Gathered(tolerance[rows[0]].as_py(), np.empty((len(NUMBERS), trials)))
            known, found = gathered[number], rows[identifiable[rows]]
            known.trials += len(rows)
            known.passed += int(np.count_nonzero(passed[rows]))
            known.failures.update(failure.take(rows).drop_null().to_pylist())
            known.numbers[:, known.gains : known.gains + len(found)] = [column[found] for column in numbers]
            known.gains += len(found)
    joints = tuple(gathered[number].joint_rows(number) for number in sorted(gathered))
    return StudyRows(joints=joints, failures=dict(gathered[joints[0].joint].failures.most_common()) if joints else {})


@dataclass(slots=True, eq=False)
class _Gathered:
    """What has been seen of a joint so far.

    Its numbers, shape (4, trials), have room for all from the start: memory that is never written to costs nothing, and
    what grows is there twice whenever it moves.
    """

    tolerance: float
    numbers: Array
    trials: int = 0
    gains: int = 0
    passed: int = 0
    failures: Counter[str] = field(default_factory=Counter[str])

    def joint_rows(self, joint: int) -> JointRows:
        """All of it."""
        true, std, rel_error, z = self.numbers[:, : self.gains]
        return JointRows(
            joint=joint,
            trials=self.trials,
            failed=self.failures.total(),
            passed=self.passed,
            tolerance=self.tolerance,
            true=true,
            std=std,
            rel_error=rel_error,
            z=z,
        )
