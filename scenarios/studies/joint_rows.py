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
        return self.std / np.abs(self.true)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study.

    Attributes:
        joints: One a joint, in their order.
        failures: Trials without any estimate by kind, the most frequent first.
    """

    joints: tuple[JointRows, ...]
    failures: Mapping[str, int]


def study_rows(tables: Iterable[pa.Table]) -> StudyRows:
    """Gather the rows of a study.

    Args:
        tables: A row a trial and joint, in any order and any cut, with `COLUMNS`.
    """
    gathered: dict[int, _Gathered] = {}
    for table in tables:
        for joint in pc.unique(table["joint"]).to_pylist():
            gathered.setdefault(joint, _Gathered()).add(table.filter(pc.equal(table["joint"], joint)))
    joints = sorted(gathered)
    failures = gathered[joints[0]].failures if joints else Counter[str]()
    return StudyRows(
        joints=tuple(gathered.pop(joint).joint_rows(joint) for joint in joints),
        failures=dict(failures.most_common()),
    )


@dataclass(slots=True, eq=False)
class _Gathered:
    """What has been seen of a joint so far."""

    trials: int = 0
    passed: int = 0
    tolerance: float = np.nan
    failures: Counter[str] = field(default_factory=Counter[str])
    numbers: dict[str, list[Array]] = field(default_factory=lambda: {name: list[Array]() for name in NUMBERS})

    def add(self, rows: pa.Table) -> None:
        """Take rows of this joint."""
        if not self.trials:
            self.tolerance = rows["tolerance"][0].as_py()
        self.trials += len(rows)
        self.passed += pc.sum(rows["passed"]).as_py() or 0
        self.failures.update(rows["failure"].drop_null().to_pylist())
        found = rows.filter(rows["identifiable"])
        for name, pieces in self.numbers.items():
            pieces.append(found[name].to_numpy())

    def joint_rows(self, joint: int) -> JointRows:
        """The joint; the pieces are gone afterwards, because both together are twice the memory."""
        true, std, rel_error, z = (np.concatenate(self.numbers.pop(name)) for name in NUMBERS)
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
