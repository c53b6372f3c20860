"""Registers that were logged as read are named with the key that decodes them."""

from dataclasses import replace

import numpy as np
import pytest
from foreign_logs import DESCRIPTION, Q, T, V, assert_same, channels, csv, table

from ident.recordings.description import read_description
from ident.recordings.files import likely_encoding, read_log, read_recording
from ident.support.errors import RecordingError

MILLI = np.rint(1e3 * V)
"""Currents as numbers of a register [mA]; a sign and ten bits do not hold the third, of up to 2100."""


def registers(sign_bit: int, bits: int) -> np.ndarray:
    return np.where(MILLI < 0.0, 2.0**sign_bit - MILLI if sign_bit else 2.0**bits + MILLI, MILLI)


@pytest.mark.parametrize(("sign_bit", "bits"), [(12, 0), (15, 0), (0, 16), (0, 32)])
def test_a_register_logged_as_read_is_refused_with_the_key_that_decodes_it(tmp_path, sign_bit, bits):
    path = csv(tmp_path / "log.csv", table(v=registers(sign_bit, bits)))
    stated = channels("v", unit=("mA",))
    key = f"sign_bit = {sign_bit}" if sign_bit else f"bits = {bits}"
    with pytest.raises(RecordingError, match=rf"column '[xyz]' jumps .* state {key} in \[v\]"):
        read_recording(path, stated)
    (tmp_path / "log.toml").write_text(f"[v]\n{key}\n")
    told = read_description(tmp_path / "log.toml").v
    right = replace(stated, v=replace(stated.v, sign_bit=told.sign_bit, bits=told.bits))
    assert_same(read_recording(path, right), v=1e-3 * MILLI)
    of_q = channels("q", columns=("x", "y", "z"), unit=("mm",), sign_bit=told.sign_bit, bits=told.bits)
    of_q = replace(of_q, v=replace(of_q.v, columns=("a", "b", "c")))
    assert_same(read_recording(path, of_q), q=1e-3 * MILLI, v=Q)


def test_noise_about_zero_hides_no_sign_and_columns_that_reach_a_power_of_two_have_none(rng):
    slow = np.rint(300.0 * np.sin(np.arange(4000) / 700.0) + rng.normal(0.0, 60.0, 4000))
    assert likely_encoding(np.where(slow < 0.0, 1024.0 - slow, slow)) == "sign_bit = 10"
    for offset in (1023.0, 1500.0, 32_768.0, 65_400.0):
        assert likely_encoding(slow + offset) == ""
    assert likely_encoding(slow) == likely_encoding(np.abs(slow)) == likely_encoding(slow + 1024.5) == ""
    assert DESCRIPTION.v.sign_bit == ()


def test_an_encoder_that_passes_the_end_of_its_turn_is_no_register(tmp_path):
    for turn in (4096, 65_536):
        ticks = np.column_stack([np.rint(turn * each) % turn for each in (0.07 * np.sin(9.0 * T), 0.2 * T, -0.11 * T)])
        assert (np.abs(np.diff(ticks, axis=0)) > 0.9 * turn).any()
        path = csv(tmp_path / "log.csv", table(q=ticks))
        log = read_log(path, channels("q", unit=("ticks",), counts_per_turn=(float(turn),)), check=None)
        np.testing.assert_allclose(log.recording.q, 2.0 * np.pi * ticks / turn, rtol=1e-12)
    assert likely_encoding(np.array([4093.0, 4094.0, 4095.0, 0.0, 3.0])) == ""  # no sign in bit 11
