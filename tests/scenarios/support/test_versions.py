import shutil
from pathlib import Path

import pytest
from places import ROOT

from scenarios.support.versions import CODE, digests, files, versions


@pytest.fixture
def copied(tmp_path) -> Path:
    for package in CODE:
        shutil.copytree(ROOT / package, tmp_path / package)
    return tmp_path


def test_a_copy_has_the_same_digests(copied):
    assert digests(copied) == files()


@pytest.mark.parametrize(
    "name",
    [
        "rx90_mjcf/robot.toml",
        "rx90_mjcf/payload_offset.toml",
        "rx90_mjcf/rx90.xml",
        "scenarios/catalog/nominal.toml",
        "scenarios/catalog/motions/drive-gains.toml",
        "sim/record.py",
        "ident/model/regressor.py",
        "scenarios/experiments/draws.py",
    ],
)
def test_a_byte_more_in_any_file_that_decides_a_row_is_seen_and_named(copied, name):
    assert (copied / name).is_file()
    with (copied / name).open("ab") as file:
        file.write(b"\n")
    changed = digests(copied)
    assert {other for other in changed if changed[other] != files()[other]} == {name}


@pytest.mark.parametrize(
    "name", ["rx90_mjcf/mesh/link.stl", "rx90_mjcf/robot.json", "scenarios/catalog/new.toml", "sim/x"]
)
def test_a_file_of_any_kind_more_or_less_is_seen(copied, name):
    (copied / name).parent.mkdir(exist_ok=True)
    (copied / name).write_bytes(b"1")
    assert set(digests(copied)) - set(files()) == {name}
    (copied / "sim" / "record.py").unlink()
    assert set(files()) - set(digests(copied)) == {"sim/record.py"}


def test_what_python_derives_and_what_is_hidden_decides_nothing(copied):
    for name in ("sim/__pycache__/x.pyc", "sim/.record.py.swp", "ident/.cache/x"):
        (copied / name).parent.mkdir(exist_ok=True)
        (copied / name).write_bytes(b"1")
    assert digests(copied) == files()


def test_versions_change_with_the_files(monkeypatch):
    import scenarios.support.versions as module

    before = versions()["code"]
    versions.cache_clear()
    with monkeypatch.context() as patched:
        patched.setattr(module, "files", lambda: {**files(), "sim/record.py": "0" * 16})
        assert versions()["code"] != before
    versions.cache_clear()
    assert versions()["code"] == before


def test_an_optional_package_is_recorded_where_it_is_installed(monkeypatch):
    monkeypatch.setattr("scenarios.support.versions.PACKAGES", ("scipy", "numpy", "no-such-package"))
    monkeypatch.setattr("scenarios.support.versions.OF_EXTRAS", ("numpy", "no-such-package"))
    assert list(versions.__wrapped__()) == ["python", "scipy", "numpy", "code"]
    monkeypatch.setattr(
        "scenarios.support.versions.DISTRIBUTIONS", {"numpy": ("scipy", "numpy")}
    )  # the first one found
    assert versions.__wrapped__()["numpy"] == versions.__wrapped__()["scipy"]
