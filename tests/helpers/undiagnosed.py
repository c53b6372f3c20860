"""Identification of sound logs without their diagnosis, which takes most of the time."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

import ident.identification
import ident.preparation
from ident.diagnosis.diagnosis import Diagnosed

MODULES = (ident.identification, ident.preparation)


@contextmanager
def undiagnosed() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for module in MODULES:
            patch.setattr(module, "diagnose", lambda *_: Diagnosed())
        patch.setattr(ident.identification, "lacking", lambda *_: Diagnosed())
        yield
