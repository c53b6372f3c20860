"""Recordings: what they refuse, uniform clocks, files, copies, and their order in time."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from foreign_logs import unread
from refusals import refused

from ident.payload.payload import Payload, write_payload
from ident.recordings.files import read, read_recording, write_recording
from ident.recordings.recording import (
    LARGEST_CURRENT,
    LARGEST_POSITION,
    Motion,
    Recording,
    has_marks,
    in_order_of_time,
    resampled,
    row_marks,
    share_samples,
)
from ident.support.errors import RecordingError

T = 0.01 * np.arange(50)
Q, V = np.random.default_rng(4).normal(size=(2, 50, 2))
LOG = Recording(T, Q, V, "motion")


def changed(x: np.ndarray, *at: int, to: float) -> np.ndarray:
    x = x.copy()
    x[at] = to
    return x


FAULTS = {
    r"motion: t, q and v have shapes \(49,\), \(50, 2\) and \(50, 2\)": {"t": T[1:]},
    "the recording has no joint": {"q": Q[:, :0], "v": V[:, :0]},
    "1 samples are too few": {"t": T[:1], "q": Q[:1], "v": V[:1]},
    r"q2 is not a finite number at row 8 \(1 such values\)": {"q": changed(Q, 7, 1, to=np.nan)},
    "v1 is not a finite number at row 9": {"v": changed(V, 8, 0, to=np.inf)},
    "t is not a finite number at row 1": {"t": changed(T, 0, to=np.nan)},
    r"q2 = -1\.001e\+06 at row 6 \(1 such values\); expected up to 1e\+06": {
        "q": changed(Q, 5, 1, to=-1.001 * LARGEST_POSITION)
    },
    r"v2 = 1\.001e\+12 at row 6 .*; expected up to 1e\+12": {"v": changed(V, 5, 1, to=1.001 * LARGEST_CURRENT)},
    r"time does not increase at row 9: t = 0\.07 s after 0\.07 s$": {"t": changed(T, 8, to=T[7])},
    r"row 9: t = 0\.02 s after 0\.07 s; if the file holds several recordings": {"t": changed(T, 8, to=0.02)},
    "q2 never changes; .*to leave out a gripper .* name the others: q=NAME": {"q": changed(Q, slice(None), 1, to=0.3)},
    "q1 never changes; .* the channel was not logged$": {"q": changed(Q, slice(None), 0, to=0.3)},
    "v1 never changes; the joint did not move or the channel was not logged$": {"v": changed(V, slice(None), 0, to=0)},
}


def test_impossible_samples_are_refused_with_their_place():
    for message, fields in FAULTS.items():
        refused(RecordingError, message, replace, LOG, **fields)
    replace(LOG, q=changed(Q, 5, 1, to=-LARGEST_POSITION), v=changed(V, 5, 1, to=LARGEST_CURRENT))
    twice = np.repeat(np.arange(25), 2)
    refused(RecordingError, r"row 2: .*; 25 rows repeat the time of the row before", replace, LOG, t=T[twice])
    refused(RecordingError, r"row 2: .*; 25 rows repeat earlier rows", replace, LOG, t=T[twice], q=Q[twice], v=V[twice])
    with pytest.raises(RecordingError) as caught:
        replace(LOG, q=changed(Q, 5, 1, to=2e6))
    assert (caught.value.joint, caught.value.value, caught.value.bounds) == (1, 2e6, (-1e6, 1e6))
    with pytest.raises(ValueError, match="read-only"):
        LOG.q[0, 0] = 0.0


def test_files_keep_every_digit_and_say_what_v_is(tmp_path):
    for path in (tmp_path / "log.csv", tmp_path / "log.parquet"):
        write_recording(LOG, path, signal="current [A]")
        back = read_recording(path)
        for name in ("t", "q", "v"):
            np.testing.assert_array_equal(getattr(back, name), getattr(LOG, name))
    assert (tmp_path / "log.csv").read_text().startswith("# v: current [A]\nt,q1,q2,v1,v2\n")
    assert pq.read_schema(path).metadata[b"v"] == b"current [A]"
    frame = pd.read_parquet(path)
    assert list(frame.columns) == ["t", "q1", "q2", "v1", "v2"]
    frame.assign(note="x").to_parquet(path, index=False)  # further columns do not matter
    np.testing.assert_array_equal(read_recording(path).v, V)


def test_a_bit_that_flips_in_a_recording_as_we_write_it_is_noticed(tmp_path):
    write_recording(LOG, path := tmp_path / "log.parquet")
    content = bytearray(path.read_bytes())
    content[content.index(Q[17, 1].tobytes()) + 3] ^= 4  # in the mantissa
    path.write_bytes(content)
    unread("not a readable Parquet file", path)


@pytest.mark.parametrize("values", [[0.3, 0.7, None, 0.2], [3, 7, None, 2]])
def test_a_value_that_is_missing_in_parquet_is_refused_with_its_row(tmp_path, values):
    t, four = 0.125 * np.arange(4), np.array([0.4, 0.5, 0.7, 0.6])
    pq.write_table(pa.table({"t": t, "q1": pa.array(values), "v1": four}), tmp_path / "log.parquet")
    unread(r"q1.* 3", tmp_path / "log.parquet")


def test_a_uniform_clock_is_left_alone_and_a_jittered_one_resampled(rng):
    assert resampled(LOG) is LOG
    uneven = 0.01 * np.arange(400) + np.r_[0, rng.uniform(-0.003, 0.003, 398), 0]
    even = resampled(Recording(uneven, np.sin(uneven)[:, None], np.cos(uneven)[:, None]))
    assert even.jitter < 1e-9
    np.testing.assert_allclose(even.q[:, 0], np.sin(even.t), atol=1e-9)  # cubic spline: h^4 / 384
    np.testing.assert_allclose(even.v[:, 0], np.cos(even.t), atol=4e-5)  # straight lines: h^2 / 8, h = 16 ms


def test_an_interval_of_ten_others_is_a_hole_and_nothing_is_invented_for_it(rng):
    # 40 and 59 samples on either side: the interval begins in row 40.
    q, v = rng.normal(size=(2, 99, 2))
    short, long = (
        Recording(0.02 * (np.arange(99) + (share - 1.0) * (np.arange(99) >= 40)), q, v) for share in (9.9, 10.1)
    )
    np.testing.assert_allclose(np.diff(resampled(short).t), short.period, rtol=1e-9)  # of sums in float64
    refused(RecordingError, r"missing: 0\.202 s pass from row 40 to the next, usually 0\.02 s", resampled, long)


def test_motions_are_read_with_their_payload_and_sorted_by_absolute_time(tmp_path):
    payload = Payload(mass=2.5, known="mass")
    write_payload(payload, tmp_path / "p.toml")
    write_recording(LOG, tmp_path / "log.csv")
    assert read(tmp_path / "log.csv").payload is None
    assert read(tmp_path / "log.csv", payload).payload is payload
    assert read(tmp_path / "log.csv", tmp_path / "p.toml").payload == payload
    late, early, plain = (Motion(replace(LOG, t=T + start)) for start in (1.7e9 + 5.0, 1.7e9, 30.0))
    assert in_order_of_time([late, early]) == (early, late)
    assert in_order_of_time([late, plain, early]) == (late, plain, early)


def recorded(seed: int, *, rows: int = 3000, rest: int = 0) -> Recording:
    """The same motion of three joints each time, with noise of its own; at rest, in several poses, numbers stay."""
    rng, t = np.random.default_rng(seed), np.arange(rows) * 1e-3
    q = 0.7 * np.sin(t[:, None] * [1.1, 1.9, 2.3]) + 2e-6 * rng.standard_normal((rows, 3))
    v = 5.0 * np.cos(t[:, None] * [1.1, 1.9, 2.3]) + 0.1 * rng.standard_normal((rows, 3))
    q[:rest] = 0.01 * (np.arange(rest) // 75)[:, None]
    v[:rest] = [0.5, -0.5, 0.0]
    return Recording(t, q, v, f"log {seed}")


def part(log: Recording, which: slice) -> Recording:
    return replace(log, t=log.t[which], q=log.q[which], v=log.v[which], name="copy")


COPIES = {
    "whole": lambda log: log,
    "cut": lambda log: part(log, slice(1100, 1700)),
    "brief": lambda log: part(log, slice(2000, 2020)),
    "thinned": lambda log: part(log, slice(3, None, 7)),
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
    assert has_marks(copy, row_marks(log)) == (what != "brief")  # 20 of 3000 rows have none of 64 hashes
    assert not has_marks(other, row_marks(log))
    assert not has_marks(log, ())


def test_rest_and_the_row_at_a_cut_are_no_copy():
    assert not share_samples(recorded(1, rest=2970), recorded(2, rest=2970))
    log = recorded(1, rows=60)
    assert not share_samples(part(log, slice(0, 31)), part(log, slice(30, None)))
    assert share_samples(part(log, slice(0, 32)), part(log, slice(30, None)))
