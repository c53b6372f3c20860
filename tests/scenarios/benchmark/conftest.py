"""Methods are named in many tests; which distribution brings which package takes a second to find out."""

from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions

import pytest


@pytest.fixture(scope="session", autouse=True)
def _distributions_found_once() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scenarios.benchmark.methods.packages_distributions", cache(packages_distributions))
        yield
