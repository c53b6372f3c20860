import sys

import pytest
from places import ROOT

from scenarios.cli import main

FIGAROH, SYSID = "docs.adapters.figaroh_tls", "docs.adapters.mujoco_sysid"


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name in (FIGAROH, SYSID):
        monkeypatch.delitem(sys.modules, name, raising=False)
    yield
    for name in (FIGAROH, SYSID):
        sys.modules.pop(name, None)


def test_an_absent_library_is_one_line_that_says_what_to_install(monkeypatch, capsys):
    for module, package, advice in (
        (FIGAROH, "figaroh", "FIGAROH or what it needs is missing; pip install figaroh==1.0.2"),
        (SYSID, "mujoco.sysid", 'mujoco.sysid or what it needs is missing; pip install "mujoco[sysid]>=4.0"'),
    ):
        for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setitem(sys.modules, package, None)
        assert main(["compare", "nominal", "--method", f"{module}:drive_gains", "-n", "1", "--out", "o"]) == 2
        assert capsys.readouterr().err == f"rx90: method '{module}:drive_gains': {advice}\n"
