"""Shared values: the arm, its structure, where the real recordings are."""

import gc
import os
from pathlib import Path

import numpy as np
import pytest
from once import computed_once
from places import ROOT
from threadpoolctl import threadpool_limits
from weighed_cell import make_cell

import rx90_mjcf
from ident.model.arm import Arm, load_arm
from ident.model.structure import Structure, structure_of
from ident.payload.payload import Payload, read_payload
from scenarios.__main__ import ONE_THREAD

for name in ONE_THREAD:  # as `make` does: processes that tests start compute on one thread each
    os.environ.setdefault(name, "1")

LONG = [
    "test_same_doubts",
    "test_interruptions",
    "test_cost",
    "test_process",
    "test_pages_in_chromium",
    "test_identification",
    "test_all_joints_selection",
    "test_faults",
    "test_diagnosis",
    "test_budget",
    "test_common_delay",
    "test_extras",
    "test_new_robot",
    "test_payload_design",
    "test_methods",
    "test_identify_unseen",
    "test_monte_carlo",
    "test_record",
    "test_predictor",
    "test_scenarios",
    "test_saved_folders",
]
"""Modules of many seconds, which begin first: workers take modules as a whole, and are to end at about one time."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: LONG.index(item.path.stem) if item.path.stem in LONG else len(LONG))


def pytest_collection_finish() -> None:
    """Modules and thousands of tests live to the end: the garbage collector need not go through them each time.

    They are not frozen: by what is frozen a worker of a study is recognised, which collects after every trial.
    """
    gc.set_threshold(3_000)


@pytest.fixture(scope="session", autouse=True)
def _one_blas_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session", autouse=True)
def _a_sentence_a_line():
    """Tests look for sentences; those of how a narrow page is filled state its width."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "10000")
        yield


@pytest.fixture(scope="session")
def arm() -> Arm:
    return load_arm(rx90_mjcf.MJCF)


@pytest.fixture(scope="session")
def structure(arm: Arm) -> Structure:
    return structure_of(arm)


@pytest.fixture(scope="session")
def payload() -> Payload:
    return read_payload(rx90_mjcf.PAYLOADS["7.025 kg"])


@pytest.fixture(scope="module")
def _computed_once():
    """For many commands that read the same files; `test_estimators` holds that the same data give the same digits."""
    with computed_once():
        yield


@pytest.fixture(scope="session")
def weighed_cell(tmp_path_factory) -> Path:
    return make_cell(tmp_path_factory.mktemp("weighed-cell"))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.fixture(scope="session")
def real() -> Path:
    folder = Path(os.environ.get("REAL_RECORDINGS", ROOT.parent / "shared" / "real"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings in {folder}; name their folder in REAL_RECORDINGS")
    return folder
