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


def test_a_byte_a_file_more_or_a_file_less_is_seen_and_named_and_what_python_derives_is_not(copied):
    assert digests(copied) == files()
    for name in ("sim/__pycache__/x.pyc", "sim/.record.py.swp", "ident/.cache/x"):
        (copied / name).parent.mkdir(exist_ok=True)
        (copied / name).write_bytes(b"1")
    assert digests(copied) == files()
    new = {"rx90_mjcf/mesh/link.stl", "rx90_mjcf/robot.json", "scenarios/catalog/new.toml", "sim/x"}
    for name in new:
        (copied / name).parent.mkdir(exist_ok=True)
        (copied / name).write_bytes(b"1")
    edited = {"rx90_mjcf/robot.toml", "rx90_mjcf/payload_offset.toml", "rx90_mjcf/rx90.xml", "sim/record.py"}
    edited |= {f"scenarios/{name}" for name in ("catalog/nominal.toml", "catalog/motions/drive-gains.toml", "cli.py")}
    for name in edited:
        with (copied / name).open("ab") as file:
            file.write(b"\n")
    (copied / "ident/model/regressor.py").unlink()
    changed = digests(copied)
    assert set(changed) - set(files()) == new
    assert set(files()) - set(changed) == {"ident/model/regressor.py"}
    assert {name for name in files() if name in changed and changed[name] != files()[name]} == edited


def test_an_optional_package_is_recorded_where_it_is_installed(monkeypatch):
    monkeypatch.setattr("scenarios.support.versions.PACKAGES", ("scipy", "numpy", "no-such-package"))
    monkeypatch.setattr("scenarios.support.versions.OF_EXTRAS", ("numpy", "no-such-package"))
    assert list(versions.__wrapped__()) == ["python", "scipy", "numpy", "code"]
    monkeypatch.setattr(
        "scenarios.support.versions.DISTRIBUTIONS", {"numpy": ("scipy", "numpy")}
    )  # the first one found
    assert versions.__wrapped__()["numpy"] == versions.__wrapped__()["scipy"]
