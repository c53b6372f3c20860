from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest
from annotated_types import Interval, Unit
from refusals import refused

from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.support.errors import OptionError
from ident.support.options import options_from_table, options_from_words, refuse_outside, table_from_words


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """Options of every type."""

    blocks: int = 20
    width: float = 0.5
    robust: bool = False
    kernel: str = "bartlett"
    seed: int | None = None


def test_a_table_gives_options_and_what_it_leaves_out_keeps_its_default():
    found = options_from_table(Sample, {"blocks": 7, "robust": True, "width": 3})
    assert found == Sample(blocks=7, robust=True, width=3.0)
    assert isinstance(found.width, float)
    assert options_from_table(Sample, {"seed": 11}).seed == 11
    assert options_from_table(Sample, {"width": np.float64(0.7), "seed": None}) == Sample(width=0.7)
    assert options_from_table(Sample, {}) == Sample()


def test_words_give_the_same_options_as_a_table():
    words = ["blocks=7", "robust=true", "width = 2.5e-3", "kernel=tent", "seed=4"]
    assert options_from_words(Sample, words) == Sample(blocks=7, robust=True, width=2.5e-3, kernel="tent", seed=4)
    assert options_from_words(Sample, ["robust=False"]) == Sample()
    assert table_from_words(Sample, ["width = 3", "kernel=7", "block-size=2"]) == {
        "width": 3.0, "kernel": "7", "block_size": "2",
    }  # fmt: skip


WRONG = {
    r"unknown key 'block'; did you mean 'blocks'\?; known: blocks, width, robust, kernel, seed": {"block": 7},
    r"blocks = 7\.5: expected a whole number": {"blocks": 7.5},
    "width = 'wide': expected a number": {"width": "wide"},
    "robust = 1: expected true or false": {"robust": 1},
    "kernel = 3: expected a name": {"kernel": 3},
    "option 'blocks': expected KEY=VALUE": ["blocks"],
    "option '=7': expected KEY=VALUE": ["=7"],
    "option blocks is given twice": ["blocks=7", "blocks=8"],
    "robust = 'yes': expected true or false": ["robust=yes"],
}


@pytest.mark.parametrize("message", WRONG)
def test_a_wrong_table_or_word_names_the_option_and_what_it_takes(message):
    given = WRONG[message]
    refused(OptionError, message, options_from_table if isinstance(given, dict) else options_from_words, Sample, given)


@pytest.mark.parametrize(
    ("kind", "name", "inside", "outside"),
    [
        (GainOptions, "rank_tol", (1e-300, 0.999), (0.0, 1.0, -1e-7, np.nan)),
        (ObserveOptions, "rows_per_second", (1e-3, 30.0), (0.0, 9e-4, 30.1, 1.01e5, np.nan)),
    ],
)
def test_options_take_numbers_in_their_range_and_no_others(kind, name, inside, outside):
    for value in inside:
        assert getattr(replace(kind(), **{name: value}), name) == value
    for value in outside:
        refused(OptionError, f"^{name} = ", replace, kind(), **{name: value})


@dataclass
class Ranged:
    delay: Annotated[float, Interval(ge=-0.5, le=2.0), Unit("s")] = 0.3
    tol: Annotated[float, Interval(gt=0.2, lt=0.7)] = 0.4


def test_a_range_says_what_it_wants():
    for inside in (Ranged(delay=-0.5), Ranged(delay=2.0), Ranged(tol=0.21), Ranged(tol=0.69)):
        refuse_outside(inside, OptionError)
    for outside, message, place in (
        (Ranged(delay=3.0), r"^delay = 3: expected -0\.5 to 2 s$", ""),
        (Ranged(tol=0.7), r"^motor: tol = 0\.7: expected more than 0\.2 to less than 0\.7$", "motor"),
        (Ranged(tol=0.2), r"^tol = 0\.2: ", ""),
        (Ranged(tol=float("nan")), r"^tol = nan: expected a finite number$", ""),
    ):
        with pytest.raises(OptionError, match=message) as caught:
            refuse_outside(outside, OptionError, place)
        if outside.delay == 3.0:
            assert (caught.value.value, caught.value.bounds) == (3.0, (-0.5, 2.0))
    assert (caught.value.value, caught.value.bounds) == (None, None)


def test_an_uncertainty_that_does_not_exist_is_named_with_those_that_do():
    expected = "uncertainty = 'bootstrap': expected one of classical, jackknife, cautious"
    refused(OptionError, expected, GainOptions, uncertainty="bootstrap")
