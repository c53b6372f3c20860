"""Results of an object are computed once for it, and freed with it."""

import gc
import weakref

import numpy as np
import pytest

from ident.recordings.recording import Recording, resampled
from ident.support.arrays import once_per_object


class Thing:
    """Compared by identity."""


def test_each_object_and_each_set_of_further_arguments_is_asked_once_and_errors_are_not_kept():
    calls, broken = [], [True]

    @once_per_object
    def found(of: Thing, *more: int) -> list[int]:
        if more == (9,) and broken.pop():
            broken.append(False)
            raise LookupError
        calls.append((id(of), *more))
        return [*more, 7]

    things = [Thing() for _ in range(300)]  # more than any cache of a fixed size would hold
    for each in 2 * things:
        assert [found(each), found(each, 3), found(each, 3, 5)] == [[7], [3, 7], [3, 5, 7]]
    assert len(calls) == len(set(calls)) == 900
    with pytest.raises(LookupError):
        found(things[0], 9)
    assert found(things[0], 9) == [9, 7]
    seen = weakref.ref(things.pop())
    each = None
    gc.collect()
    assert seen() is each


def test_a_recording_on_a_uniform_clock_is_freed_with_the_recorded_one(rng):
    seen = list[weakref.ref[Recording]]()
    for jitter in (0.0, 0.2):
        t = (np.arange(50) + jitter * rng.uniform(-1.0, 1.0, 50)) / 500.0
        log = Recording(t, rng.normal(size=(50, 2)), rng.normal(size=(50, 2)))
        seen += [weakref.ref(log), weakref.ref(resampled(log))]
        assert resampled(log) is seen[-1]()
        del log
    gc.collect()
    assert [each() for each in seen] == [None] * 4
