"""One call of a method on one problem: claims or why there are none, and the time it took."""

import time
from dataclasses import dataclass
from pathlib import Path

from scenarios.benchmark.methods.answer import read_answer
from scenarios.benchmark.methods.method import Method
from scenarios.benchmark.methods.process import Limits, run_limited
from scenarios.experiments.judge import Claim
from scenarios.support.errors import MethodError


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """How a call ended.

    Attributes:
        outcome: One claim a joint, or the error that stands for there being none.
        seconds: Wall time, start of the process included [s].
    """

    outcome: tuple[Claim, ...] | MethodError
    seconds: float


def call(method: Method, folder: Path, joints: int, limits: Limits) -> Call:
    """Call a method; whatever it does, there is an outcome.

    Args:
        method: The method.
        folder: The problem's.
        joints: Of the arm.
        limits: What it may take.
    """
    started = time.perf_counter()
    try:
        said = run_limited((*method.words, str(folder.absolute())), limits)
        return Call(outcome=read_answer(said.text, joints), seconds=said.seconds)
    except MethodError as error:
        return Call(outcome=error, seconds=time.perf_counter() - started)
