"""A motion that is given twice is recognised whole, cut, thinned and in fewer digits; repetitions are none."""

from dataclasses import replace

import numpy as np
import pytest

from ident.recordings.recording import Recording, share_samples


def recorded(seed: int, *, rows: int = 3000, rest: int = 0) -> Recording:
    """The same motion of three joints each time, with noise of its own; at rest, in several poses, numbers stay."""
    rng, t = np.random.default_rng(seed), np.arange(rows) * 1e-3
    q = 0.7 * np.sin(t[:, None] * [1.1, 1.9, 2.3]) + 2e-6 * rng.standard_normal((rows, 3))
    v = 5.0 * np.cos(t[:, None] * [1.1, 1.9, 2.3]) + 0.1 * rng.standard_normal((rows, 3))
    q[:rest] = 0.01 * (np.arange(rest) // 75)[:, None]
    v[:rest] = [0.5, -0.5, 0.0]
    return Recording(t, q, v, f"log {seed}")


def rows_of(log: Recording, which: slice) -> Recording:
    return replace(log, t=log.t[which], q=log.q[which], v=log.v[which], name="copy")


COPIES = {
    "whole": lambda log: log,
    "cut": lambda log: rows_of(log, slice(1100, 1700)),
    "brief": lambda log: rows_of(log, slice(2000, 2020)),
    "thinned": lambda log: rows_of(log, slice(3, None, 7)),
    "from zero": lambda log: replace(rows_of(log, slice(900, None)), t=log.t[900:] - log.t[900]),
    "single precision": lambda log: replace(log, q=log.q.astype(np.float32), v=log.v.astype(np.float32)),
    "six digits": lambda log: replace(log, q=np.round(log.q, 6), v=np.round(log.v, 6)),
    "joined": lambda log: Recording(
        np.arange(6000.0), np.vstack((recorded(3).q, log.q)), np.vstack((recorded(3).v, log.v)), "joined"
    ),
}


@pytest.mark.parametrize("what", COPIES)
def test_a_copy_shares_samples_with_its_recording_and_with_no_other(what):
    log, other = recorded(1), recorded(2)
    copy = COPIES[what](log)
    assert share_samples(log, copy)
    assert share_samples(copy, log)
    assert not share_samples(other, copy)
    assert not share_samples(log, replace(log, v=-log.v))
    assert not share_samples(log, replace(log, q=log.q + 0.1))


def test_halves_of_a_recording_share_nothing_but_the_row_where_it_was_cut():
    log = recorded(1, rows=60)
    assert not share_samples(rows_of(log, slice(0, 31)), rows_of(log, slice(30, None)))
    assert share_samples(rows_of(log, slice(0, 32)), rows_of(log, slice(30, None)))


def test_rest_that_two_recordings_have_alike_is_no_copy():
    assert not share_samples(recorded(1, rest=2970), recorded(2, rest=2970))
