"""Tests of commands expect one line on stderr, on slow machines too."""

from collections.abc import Iterator

import pytest

import scenarios.workers.stages as stages


@pytest.fixture(scope="session", autouse=True)
def _no_sign_of_life_within_a_test() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "FIRST_LINE", 600.0)
        yield
