"""What comes back of the tasks of a study is kept: parts in its folder, and blocks of parts made one part."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import pyarrow as pa
import pyarrow.compute as pc

from scenarios.experiments.studies.folder import StudyFolder
from scenarios.experiments.studies.parts import LOST, WHOLE, Part, block_of
from scenarios.experiments.trials import OUTSIDE, Task


@dataclass(frozen=True, slots=True)
class Unfinished:
    """What blocks still wait for.

    Attributes:
        missing: Trials that were not there when work began, in order.
        left: Of which so many are not there yet, by the first trial of each block that was worked on.
    """

    missing: Sequence[range]
    left: dict[int, int] = field(default_factory=dict[int, int])

    def finish(self, trials: range) -> range | None:
        """Count trials of one block as finished; the block if it waits for no more."""
        block = block_of(trials.start)
        before = self.left.get(block.start)
        if before is None:
            before = sum(max(0, min(gap.stop, block.stop) - max(gap.start, block.start)) for gap in self.missing)
        self.left[block.start] = before - len(trials)
        return None if self.left[block.start] else block


def keep(place: StudyFolder, task: Task, rows: pa.Table, unfinished: Unfinished) -> None:
    """Write what came back of a task, finished trials and lost ones apart, each run of them one part."""
    lost = set(rows.filter(pc.is_in(rows["failure"], pa.array(OUTSIDE)))["trial"].to_pylist())
    numbers = [trial.number for trial in task.trials]
    for ending, run in itertools.groupby(numbers, key=lambda number: LOST if number in lost else WHOLE):
        members = list(run)
        part = Part(range(members[0], members[-1] + 1), ending)
        place.write_part(part, rows.filter(pc.is_in(rows["trial"], pa.array(part.trials, pa.int64()))))
        block = unfinished.finish(part.trials) if ending == WHOLE else None
        if block is not None:
            place.merge(block)
