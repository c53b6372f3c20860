"""Values on one line of TOML are read back as they were."""

import tomllib

import numpy as np
import pytest

from scenarios.support.toml_text import toml_value

CONTROL = "".join(map(chr, (*range(0x20), 0x7F)))


@pytest.mark.parametrize(
    "value",
    [
        f"a{CONTROL}b",
        'a "b" \\ c \\u007f',
        "\u00fcn\u00ef \u2028 \U0001f9be \U000e0001",
        ["x\x7f", [2.5, -3], []],
        {"mass": 7.3, "all": True, "deep": {"of": ("a", "b")}, "none": {}},
        7,
        -0.1 + 1e-17,
        float("inf"),
    ],
)
def test_a_value_is_read_back_as_it_was(value):
    text = toml_value(value)
    assert "\n" not in text
    expected = {**value, "deep": {"of": ["a", "b"]}} if isinstance(value, dict) else value
    assert tomllib.loads(f"x = {text}")["x"] == expected


def test_a_number_of_numpy_s_is_a_number():
    assert toml_value({"g": np.float64(-0.25), "none": {}}) == "{ g = -0.25, none = {} }"
