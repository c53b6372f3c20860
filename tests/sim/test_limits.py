"""What is too much for anybody's machine is refused in one line, before memory or time is spent."""

import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from places import ROOT
from plants import BELIEF, CYLINDER, experiment, nominal_plant, short_motion, streams, try_record

from sim.compile import plant_model
from sim.controller import ControllerOptions
from sim.effects import ModelErrors
from sim.engine import Engine, Simulation
from sim.errors import Diverged, PlantError, SimulationError
from sim.experiment import substeps
from sim.model_spec import silenced
from sim.record import record


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"step": 1e-12}, PlantError, r"2 s in steps of 1e-12 s are 2e\+12 steps; 5e\+07 at most"),
        ({"step": 0.0}, PlantError, r"step = 0 s: expected a positive number"),
        ({"step": -1e-3}, PlantError, r"step = -0\.001 s: expected a positive"),
        ({"step": np.nan}, PlantError, r"step = nan s: expected a positive"),
        ({"step": 1.0}, PlantError, r"step 1 s does not divide the control period 0\.001 s"),
        ({"trajectory": short_motion(duration=1e9)}, PlantError, r"1e\+09 s in steps of 0\.001 s"),
        (
            {"trajectory": short_motion(duration=400.0), "controller": ControllerOptions(rate_hz=1e5), "step": 1e-5},
            PlantError,
            r"400 s at 100000 Hz are 4e\+07 samples of 6 joints; 5e\+07 numbers at most",
        ),
    ],
)
def test_an_experiment_that_nobody_can_wait_for_is_refused_at_once(changes, kind, message):
    started = time.process_time()
    (outcome,) = try_record([experiment(**changes)], streams(0), threads=1)
    assert type(outcome) is kind
    with pytest.raises(kind, match=message):
        raise outcome
    assert "\n" not in str(outcome)
    assert time.process_time() - started < 1.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: nominal_plant(gain=np.full(6, 1e308)),
        lambda: nominal_plant(rotor_inertia=np.full(6, 1e10)),
        lambda: nominal_plant(amplifier_offset=np.full(6, -1e10)),
        lambda: nominal_plant(replace(CYLINDER, mass=1e9)),
        lambda: nominal_plant(replace(CYLINDER, mass=0.0)),
        lambda: nominal_plant(replace(CYLINDER, mass=np.nan)),
        lambda: nominal_plant(replace(CYLINDER, com=(0.0, np.nan, 0.1))),
        lambda: nominal_plant(replace(CYLINDER, com=(0.0, 0.0, -1e3))),
        lambda: nominal_plant(replace(CYLINDER, inertia=(1e9, 1e9, 1e9, 0.0, 0.0, 0.0))),
        lambda: nominal_plant(errors=ModelErrors(joint_compliance=(1e3,) * 6)),
        lambda: nominal_plant(errors=ModelErrors(gravity_spring=1e300)),
        lambda: nominal_plant(errors=ModelErrors(stribeck_speed=1e-300)),
        lambda: replace(BELIEF, gain=(1e308,) * 6),
        lambda: replace(BELIEF, rotor_inertia=(np.inf,) * 6),
        lambda: replace(BELIEF, rotor_inertia=(-1.0,) * 6),
    ],
)
def test_absurd_numbers_are_refused(make):
    with pytest.raises(PlantError) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_payload_that_no_body_can_be_is_refused_with_its_mass():
    impossible = replace(
        CYLINDER, inertia=(0.01, 0.01, 0.05, 0.0, 0.0, 0.0)
    )  # more about z than about x and y together
    (outcome,) = try_record([experiment(plant=nominal_plant(impossible), loaded=True)], streams(0), threads=1)
    with pytest.raises(PlantError, match=r"rx90\.xml with a payload of 7\.025 kg: "):
        raise outcome


def test_a_simulation_that_diverges_says_so_and_mujoco_says_nothing(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    wild = nominal_plant(gain=-1e6 * np.ones(6), current_limit=np.full(6, 1e9))
    for threads in (1, 2):
        outcomes = try_record([experiment(plant=wild), experiment()], streams(0, 1), threads=threads)
        assert type(outcomes[0]) is Diverged
        assert not isinstance(outcomes[1], SimulationError)
    assert not list(tmp_path.iterdir())
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


AFTERWARDS = """
import mujoco, numpy as np
from pathlib import Path
from plants import nominal_plant
from sim.compile import plant_model
from sim.model_spec import silenced

model = plant_model(nominal_plant(), loaded=False, step=1e-3)

def fall(data):
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)

try:
    with silenced():
        fall(mujoco.MjData(model))
        raise ZeroDivisionError
except ZeroDivisionError:
    assert not list(Path().iterdir())
fall(mujoco.MjData(model))
assert [path.name for path in Path().iterdir()] == ["MUJOCO_LOG.TXT"]
"""


def test_mujoco_s_own_log_is_as_before_afterwards(tmp_path):
    # In a process of its own: MuJoCo keeps to the log file that it has opened first.
    paths = {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests" / "helpers")])}
    done = subprocess.run(
        [sys.executable, "-c", AFTERWARDS], cwd=tmp_path, env=os.environ | paths, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "Nan, Inf" in done.stderr


def test_threads_of_a_batch_are_quiet_too(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    model = plant_model(nominal_plant(), loaded=False, step=1e-3)
    engine = Engine([Simulation(model=model, start=np.zeros(6))] * 4, substeps=1, threads=2)
    with silenced():
        engine.q[:] = np.nan
        engine.advance()
    assert engine.unstable().all()
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr().err == ""


def test_an_experiment_at_the_edge_of_the_ranges_runs():
    edge = ControllerOptions(rate_hz=100.0, bandwidth_hz=4.0, velocity_cutoff_hz=40.0)
    (recording,) = record([experiment(controller=edge, step=1e-3)], streams(0), threads=1)
    assert len(recording.t) == 201


def test_a_motion_has_fifty_million_steps_or_numbers_at_most():
    # 6 joints at 1 kHz: 8333.33333.. s are 50 million numbers; 10 us: 500 s are 50 million steps.
    for inside, beyond, step, what in (
        (8333.33333, 8333.33334, 1e-3, r"samples of 6 joints"),
        (499.99999, 500.000005, 1e-5, r"steps; 5e\+07 at most"),
    ):
        assert substeps(experiment(trajectory=short_motion(duration=inside), step=step)) == round(1e-3 / step)
        with pytest.raises(PlantError, match=what):
            substeps(experiment(trajectory=short_motion(duration=beyond), step=step))
