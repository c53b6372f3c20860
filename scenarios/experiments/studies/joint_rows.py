"""The rows of a study, joint by joint: what its statistics and pictures need of a million trials, and no more.

Rows are taken a part at a time and dropped, so that a study costs three numbers a trial and joint with a gain, not a
table of everything.
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
"""Injected gains that are kept of a joint at least, if there are as many: pictures show no more points."""
COLUMNS = ("joint", "true", "std", "rel_error", "z", "identifiable", "passed", "failure", "tolerance")
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
        rel_error: Relative errors of the trials that gave a gain, shape (K,); so are the others.
        claimed: Claimed relative standard deviations.
        z: Errors over claimed deviations; NaN where there is none.
        step: Of how many of these trials the injected gain of one is kept.
        true: Injected gains of every `step`-th of them, from the first [N m / drive unit], shape (ceil(K / step),).
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
        """Trials that gave a gain."""
        return len(self.rel_error)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StudyRows:
    """All rows of a study.

    Attributes:
        joints: One a joint, in their order.
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
    """Gather the rows of a study. `tables` have a row a trial and joint, in any order and any cut, with `COLUMNS`."""
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
    """What has been seen of a joint so far.

    Its numbers, shape (3, trials), have room for all from the start: memory that is never written to costs nothing, and
    what grows is there twice whenever it moves.
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
        """Take trials with a gain: their numbers, shape (3, k), and injected gains, shape (k,)."""
        self.true.append(true[-self.gains % self.step :: self.step].copy())  # not all of them behind a view
        self.numbers[:, self.gains : self.gains + len(true)] = numbers
        self.gains += len(true)

    def joint_rows(self, joint: int) -> JointRows:
        """All of it."""
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
