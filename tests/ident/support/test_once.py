"""Results of an object are computed once for it, and freed with it."""

import gc
import weakref

import numpy as np
import pytest

from ident.recordings.recording import Recording, resampled
from ident.support.arrays import once_per_object


class Thing:
    """Compared by identity."""


@pytest.fixture
def counted():
    calls = []

    @once_per_object
    def found(of: Thing, *more: int) -> list[int]:
        calls.append((id(of), *more))
        return [*more, 7]

    return found, calls


def test_each_object_and_each_set_of_further_arguments_is_asked_once(counted):
    found, calls = counted
    things = [Thing() for _ in range(300)]  # more than any cache of a fixed size would hold
    for _ in range(2):
        for each in things:
            assert found(each) == [7]
            assert found(each, 3) == [3, 7]
            assert found(each, 3, 5) == [3, 5, 7]
    assert len(calls) == len(set(calls)) == 900


def test_results_are_freed_with_their_object(counted):
    found, _ = counted
    thing = Thing()
    seen = weakref.ref(thing)
    found(thing, 4)
    del thing
    gc.collect()
    assert seen() is None


def test_an_error_is_not_kept():
    outcomes = [9, 0]

    @once_per_object
    def found(_: Thing) -> int:
        if not (outcome := outcomes.pop()):
            raise LookupError
        return outcome

    thing = Thing()
    with pytest.raises(LookupError):
        found(thing)
    assert found(thing) == 9


@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_a_recording_on_a_uniform_clock_is_freed_with_the_recorded_one(rng, jitter):
    t = (np.arange(50) + jitter * rng.uniform(-1.0, 1.0, 50)) / 500.0
    log = Recording(t, rng.normal(size=(50, 2)), rng.normal(size=(50, 2)))
    seen = [weakref.ref(log), weakref.ref(resampled(log))]
    assert resampled(log) is seen[1]()
    del log
    gc.collect()
    assert [each() for each in seen] == [None, None]
