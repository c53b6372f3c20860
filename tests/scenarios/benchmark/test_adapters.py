import sys

import numpy as np
import pytest
from exact_problem import GAIN, exact_problem
from places import ROOT

from scenarios.benchmark.methods import Limits, call, method_of
from scenarios.benchmark.study import write_trial
from scenarios.cli import main
from scenarios.experiments.loaded_scenario import load

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


# With the libraries


@pytest.mark.slow
def test_figaroh_finds_exact_gains(structure, tmp_path):
    pytest.importorskip("figaroh", reason="FIGAROH is not in the lock")
    found = call(method_of(f"{FIGAROH}:drive_gains"), exact_problem(tmp_path, structure), 6, Limits()).outcome
    np.testing.assert_allclose([claim.value for claim in found], GAIN, rtol=1e-8)


@pytest.mark.slow
def test_mujoco_sysid_finds_the_gains_of_nominal_and_refuses_the_joint_that_shows_none(tmp_path):
    pytest.importorskip("tabulate", reason="what mujoco.sysid needs is not in the lock")
    run = load("nominal").simulate(3)
    write_trial(run, tmp_path)
    claims = call(method_of(f"{SYSID}:drive_gains"), tmp_path, 6, Limits(time_s=600.0)).outcome
    assert isinstance(claims, tuple), claims
    # five stated deviations are 1.3 to 2 %
    np.testing.assert_allclose([claim.value for claim in claims[:5]], run.setup.true_gain[:5], rtol=0.02)
    assert claims[5].value is None
