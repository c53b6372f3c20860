"""What workers are given to do in tests; a module of its own, so that a fresh process can import it."""

import gc
import os
import sys
import time
import weakref
from pathlib import Path

import pyarrow as pa

from scenarios.experiments.trials import collect_garbage
from scenarios.support.errors import StudyError


def double(x: int) -> int:
    return 2 * x


def slow_double(x: int) -> int:
    time.sleep(0.3)
    return 2 * x


def double_or_die(x: int) -> int:
    """13 kills its worker every time."""
    if x == 13:
        time.sleep(0.2)  # others are under way
        os._exit(1)
    return 2 * x


def die_once(task: tuple[str, int]) -> int:
    """Kills its worker the first time: a crash that has nothing to do with the task."""
    marker, x = Path(task[0]), task[1]
    if x == 5 and not marker.exists():
        marker.touch()
        os._exit(1)
    return 2 * x


def fail(x: int) -> int:
    raise ValueError(f"cannot double {x}")


def fail_above_4(x: int) -> int:
    return double(x) if x <= 4 else fail(x)


def refuse(x: int) -> int:
    raise StudyError("this worker is of another version")


def pandas_after_a_table(gain: float) -> tuple[bool, float]:
    """Whether a table has brought pandas along, and its number as pandas has it."""
    table = pa.table({"gain": [gain]})
    loaded = "pandas" in sys.modules
    return loaded, float(table.to_pandas()["gain"][0])


def circle_survives(_: object) -> bool:
    """Whether what only refers to itself is still there behind a trial."""
    gc.disable()
    held = {3, 5}
    circle: list[object] = [held]
    circle.append(circle)
    kept = weakref.ref(held)
    del held, circle
    assert kept() is not None, "gone by itself"
    collect_garbage()
    return kept() is not None
