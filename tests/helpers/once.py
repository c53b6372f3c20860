"""What is computed once a module, however many of its commands read the same files: surveys of logs, and estimates."""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from hashlib import sha256
from io import BytesIO

import pytest

import ident.diagnosis.diagnose as diagnosing
from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.search import Survey, survey
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import ESTIMATORS, Estimator
from ident.estimation.problem import ObservedMotion, Problem


def _key(*values: object) -> bytes:
    """Of equal values the same."""
    writer = pickle.Pickler(written := BytesIO())
    writer.fast = True  # equal values are written alike, whether or not they are one object
    writer.dump(values)
    return sha256(written.getbuffer()).digest()


def _contents(problem: Problem) -> tuple[object, ...]:
    """All that an estimate can depend on; which motions share a mounting too, as equal payloads may be two."""
    first = [id(payload) for payload in problem.payloads]
    mountings = [first.index(id(each.payload)) if each.payload else None for each in problem.motions]
    return problem.structure.arm, problem.options, mountings, [_rows(each) for each in problem.motions]


def _rows(motion: ObservedMotion) -> tuple[object, ...]:
    seen = motion.observation
    full = seen.full_rate and [getattr(seen.full_rate, field.name) for field in fields(seen.full_rate)]
    return seen.joints, seen.notes, full, motion.payload


@contextmanager
def computed_once() -> Iterator[None]:
    """Equal logs are compared with every alternative once, and equal problems estimated once."""
    surveys: dict[bytes, Survey] = {}
    estimates: dict[bytes, GainEstimate] = {}

    def surveyed(logs: Logs) -> Survey:
        key = _key(logs.recordings, logs.spoilt, logs.observing, _contents(logs.problem))
        if key not in surveys:
            surveys[key] = survey(logs)  # which keeps what is compared exactly
        return surveys[key]

    def once(name: str, method: Estimator) -> Estimator:
        def estimate(problem: Problem, options: object) -> GainEstimate:
            key = _key(name, options, _contents(problem))
            if key not in estimates:
                estimates[key] = method.estimate(problem, options)
            return estimates[key]

        return Estimator(method.options, estimate)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosing, "survey", surveyed)
        for name, method in ESTIMATORS.items():
            patch.setitem(ESTIMATORS, name, once(name, method))
        yield
