"""What workers are given to do in tests; a module of its own, so that a fresh process can import it."""

import os
import time
from pathlib import Path

from scenarios.support.errors import ScenarioError


def double(x: int) -> int:
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


def refuse(x: int) -> int:
    raise ScenarioError("this worker is of another version")
