"""Adapters of libraries from elsewhere, `docs/adapters`: absent libraries are named, present ones called rightly."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from exact_problem import GAIN, PAYLOAD, exact_problem
from places import ROOT

from ident.model.structure import Structure
from scenarios.benchmark.methods import Limits, call, method_of
from scenarios.benchmark.study import write_trial
from scenarios.cli import main
from scenarios.experiments.loaded_scenario import load
from scenarios.results.problem_folder import GivenProblem, read_problem

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


def absent(monkeypatch, package: str) -> None:
    for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)


@pytest.mark.parametrize(
    ("module", "package", "advice"),
    [
        (FIGAROH, "figaroh", "FIGAROH or what it needs is missing; pip install figaroh==1.0.2"),
        (SYSID, "mujoco.sysid", 'mujoco.sysid or what it needs is missing; pip install "mujoco[sysid]>=4.0"'),
    ],
)
def test_an_absent_library_is_one_line_that_says_what_to_install(module, package, advice, monkeypatch, capsys):
    absent(monkeypatch, package)
    text = f"{module}:drive_gains"
    assert main(["compare", "nominal", "--method", text]) == 2
    assert capsys.readouterr().err == f"rx90: method '{text}': {advice}\n"


# FIGAROH's part played by a null vector of our own


def null_vector(W_u, W_l, W_payload, V_u, V_l, parameters, settings):
    """What FIGAROH's routine promises: (equations, solution scaled by the payload's mass, residual)."""
    r, first = settings["nb_samples"], 10 * settings["which_body_loaded"]
    n = len(V_u) // r
    assert W_u.shape == W_l.shape == (n * r, W_u.shape[1])
    assert len(parameters) >= 9
    assert settings["has_friction"] is settings["has_actuator_inertia"] is False  # columns are ten a body
    currents = [np.where(np.arange(n * r)[:, None] // r == np.arange(n), V[:, None], 0.0) for V in (V_u, V_l)]
    unknown = W_payload[:, first : first + 9]
    unknown = unknown[:, np.linalg.norm(unknown, axis=0) > 1e-3]
    loaded = np.hstack((unknown, W_payload[:, first + 9 : first + 10]))
    M = np.vstack((np.hstack((-W_u, currents[0], 0.0 * loaded)), np.hstack((-W_l, currents[1], -loaded))))
    v = np.linalg.svd(M, full_matrices=False)[2][-1]
    x = settings["mass_load"] * v / v[-1]
    return M, x, M @ x


def percent_of(W, x, tau):
    """Relative deviations of ordinary least squares [%], rounded as FIGAROH rounds them."""
    variance = np.sum((tau - W @ x) ** 2) / (W.shape[0] - W.shape[1])
    return np.round(100.0 * np.sqrt(variance * np.diag(np.linalg.pinv(W.T @ W))) / np.abs(x), 2)


@pytest.fixture
def adapter(monkeypatch) -> ModuleType:
    names = ("figaroh", "figaroh.tools", "figaroh.tools.regressor", "figaroh.identification")
    for name in (*names, "figaroh.identification.identification_tools"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    sys.modules["figaroh.tools.regressor"].build_total_regressor_current = null_vector
    sys.modules["figaroh.identification.identification_tools"].relative_stdev = percent_of
    monkeypatch.syspath_prepend(str(ROOT))
    return importlib.import_module(FIGAROH)


def problem(folder: Path, structure: Structure, noise: float, known: str = "all") -> GivenProblem:
    given = read_problem(exact_problem(folder, structure, noise=noise))
    bare, loaded = given.motions
    return replace(given, motions=(bare, replace(loaded, payload=replace(PAYLOAD, known=known))))


@pytest.mark.parametrize("known", ["all", "com", "mass"])
def test_figaroh_is_given_equations_that_exact_gains_solve(known, adapter, structure, tmp_path):
    given = problem(tmp_path, structure, 0.0, known)
    found = [gain["estimate"] for gain in adapter.drive_gains(given)]
    # filters and differences leave 1e-9, columns of sizes 1e-3 to 1e3 make a hundred times that of it
    np.testing.assert_allclose(found, GAIN, rtol=1e-7)
    # residuals without noise: all that rounding to 0.01 % leaves is the half of it
    share = [gain["std"] / abs(gain["estimate"]) for gain in adapter.drive_gains(given)]
    np.testing.assert_allclose(share, 5e-5, rtol=1e-12)


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
