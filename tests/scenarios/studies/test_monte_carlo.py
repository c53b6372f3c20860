import json
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from here import HERE
from quick import BRIEF, RANDOM, quick_scenario
from rich.console import Console

import scenarios.experiments.run as running
import scenarios.experiments.study as module
from ident import identification
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.estimation.estimate import IdentifiedGain
from scenarios.experiments import trials
from scenarios.experiments.draws import drawn_settings
from scenarios.experiments.run import motion_streams, run
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.experiments.study import Study, carry_out, monte_carlo
from scenarios.experiments.workers import Workers
from scenarios.support.errors import ScenarioError
from sim.record import each_record

CONTRACT = "trial seed joint true estimate std rel_error z tolerance identifiable passed reason"
pytestmark = pytest.mark.usefixtures("_all_undiagnosed")
TRIALS = 5


def rows_of(study: Study, folder: Path, workers: Workers = HERE) -> pd.DataFrame:
    """Of a study that is carried out, or completed, in a folder, as any user reads it."""
    carry_out(study, folder, workers, command="", console=Console(quiet=True))
    return pd.read_parquet(folder / "trials").sort_values(["trial", "joint"], ignore_index=True)


@pytest.fixture(scope="module")
def study(scenario) -> Study:
    return monte_carlo(load_scenario(str(scenario)), TRIALS, seed=5)


@pytest.fixture(scope="module")
def reference(study, tmp_path_factory) -> pd.DataFrame:
    """Uninterrupted, one after the other."""
    return rows_of(study, tmp_path_factory.mktemp("reference"))


def test_a_study_has_a_row_a_trial_and_joint_with_the_promised_columns_and_reasons_of_failures(reference):
    assert " ".join(reference.columns).startswith(f"{CONTRACT} ")
    assert reference["trial"].tolist() == np.repeat(np.arange(TRIALS), 6).tolist()
    assert reference["joint"].tolist() == list(range(1, 7)) * TRIALS
    assert (reference["seed"] == reference["trial"] + 5).all()
    found = reference[reference["identifiable"]]
    np.testing.assert_allclose(found["rel_error"], found["estimate"] / found["true"] - 1.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found["z"], (found["estimate"] - found["true"]) / found["std"], rtol=1e-9)
    true = [row[f"plant.gain.{row['joint']}"] for _, row in reference.iterrows()]
    np.testing.assert_array_equal(reference["true"], true)
    heavy = reference["plant.payload.mass"] == 95.0
    failed = reference[heavy]
    assert 0 < failed["trial"].nunique() < TRIALS
    assert failed["reason"].str.match(r"loaded: drive of joint\d at its limit").all()
    assert ((failed["failure"] == "Saturated") & ~failed["passed"] & failed["estimate"].isna()).all()
    assert reference[~heavy]["failure"].isna().all()


def test_rows_are_the_same_at_any_number_of_workers_and_in_any_order(study, reference, tmp_path):
    found = rows_of(study, tmp_path, Workers(lambda: ThreadPoolExecutor(2), lambda: 2))
    assert len(list((tmp_path / "trials").iterdir())) > 4
    pd.testing.assert_frame_equal(found, reference, check_exact=True)


def test_trials_share_a_batch_as_far_as_their_logs_have_room(study, reference, monkeypatch):
    sizes = []

    def counted(experiments, streams, **options):
        sizes.append(len(experiments) // 2)
        yield from each_record(experiments, streams, **options)

    # A trial logs q and v of two motions of 4 s at 500 Hz, 6 joints: 0.384 MB.
    monkeypatch.setattr(running, "LOGS_AT_ONCE", 1.2e6)
    monkeypatch.setattr(running, "each_record", counted)
    rows = trials.run_task(trials.Task(study.scenario, tuple(map(study.trial, range(TRIALS))), study.schema))
    assert sizes == [3, 2]
    pd.testing.assert_frame_equal(rows.to_pandas(), reference, check_exact=True)


class Dying(Executor):
    """Workers of which every one dies at trial 3."""

    def submit(self, function, task, /) -> Future:
        future = Future()
        if any(trial.number == 3 for trial in task.trials):
            future.set_exception(OSError("out of memory"))
        else:
            future.set_result(function(task))
        return future


def test_trials_whose_worker_dies_are_rows_that_say_so_and_are_tried_again_by_the_same_command(
    study, reference, tmp_path, monkeypatch
):
    def failing(setup, seed):
        if seed == 8:
            raise MemoryError("no room for trial 3")
        return drawn_settings(setup, seed)

    rows = rows_of(study, tmp_path, Workers(Dying, lambda: 1, OSError))
    died = rows["failure"] == "WorkerDied"
    assert set(rows[died]["trial"]) == {2, 3}  # they were one chunk
    assert (rows[died]["reason"] == "its worker died").all()
    pd.testing.assert_frame_equal(rows[~died], reference[~died], check_exact=True)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "trials").iterdir() if "2-0" not in path.name}
    assert len(kept) == 2
    with monkeypatch.context() as patched:
        patched.setattr(running, "drawn_settings", failing)
        rows = rows_of(study, tmp_path)
    assert set(rows["failure"].dropna()) == {"Saturated", "MemoryError"}
    pd.testing.assert_frame_equal(rows_of(study, tmp_path), reference, check_exact=True)
    assert {path: path.stat().st_mtime_ns for path in kept} == kept  # what was finished is not done again


def test_more_trials_than_a_study_can_have_are_refused():
    for count, seed, message in (
        (10**8 + 1, 0, "a study has 100000000 trials at most; request fewer"),
        (3, 2**31 - 2, r"3 trials from seed 2147483646 need seeds beyond 2\^31 - 1"),
    ):
        with pytest.raises(ScenarioError, match=message):
            monte_carlo(load_scenario("nominal"), count, seed)
    last = monte_carlo(load_scenario("nominal"), 2, 2**31 - 2)  # the last two seeds
    assert [last.trial(number).seed for number in range(last.count)] == [2**31 - 2, 2**31 - 1]


def test_a_worker_with_another_version_ends_the_study(study, tmp_path, monkeypatch):
    monkeypatch.setattr(trials, "versions", lambda: {"mujoco": "4.0"})
    monkeypatch.setattr(module, "versions", lambda: {"mujoco": "3.0"})
    with pytest.raises(ScenarioError, match=r"a worker has mujoco 4\.0, the study began with 3\.0"):
        rows_of(study, tmp_path)


def test_a_trial_whose_robot_cannot_be_built_is_rows_that_say_which_and_why(scenario):
    loaded, place = load_scenario(str(scenario)), "plant.payload.mass"
    wrong, good = (
        running.Trial(number=number, seed=seed, settings={place: mass}, labels={"which": which})
        for number, seed, mass, which in ((7, 23, -4.5, "built"), (3, 31, 6.9, "simulated"))
    )
    schema = trials.trial_schema(loaded, [place], ["which"])
    table = trials.run_task(trials.Task(loaded, (wrong, good), schema)).to_pandas()
    assert table["trial"].tolist() == [7] * 6 + [3] * 6
    failed, done = table[:6], table[6:]
    assert failed["joint"].tolist() == [1, 2, 3, 4, 5, 6]
    assert failed["tolerance"].tolist() == [0.2, 0.03, 0.03, 0.2, 0.03, 0.03]
    same = ["seed", "failure", "identifiable", "passed", place, "which"]
    assert failed[same].to_numpy().tolist() == [[23, "WrongValue", False, False, -4.5, "built"]] * 6
    assert failed["reason"].str.contains(r"plant\.payload\.mass: .* got -4\.5").all()
    assert failed[["true", "estimate", "std", "rel_error", "z", "payload_std"]].isna().all(axis=None)
    assert done["failure"].isna().all()
    assert done["passed"].all()


def test_what_is_drawn_makes_another_study_and_what_is_not_does_not(tmp_path):
    source = '[sources."one more"]\ntarget = "plant.gain"\ndistribution = "norm"\n'
    plain, sourced, random, wider = (
        json.dumps(module.study_identity(monte_carlo(load_scenario(str(quick_scenario(tmp_path, more))), 1, seed=0)))
        for more in ("", source, RANDOM, RANDOM.replace("scale = 0.1", "scale = 0.2"))
    )
    assert plain == sourced  # Monte Carlo draws no sources
    assert len({plain, random, wider}) == 3


def test_both_motions_and_every_sensor_have_noise_of_their_own():
    streams = ["encoder", "white", "clock"]  # coloured noise shares the generator of white noise unless it has its own
    pair = [[motion[name].random() for name in streams] for motion in motion_streams(5, {}, 2)]
    again = [[motion[name].random() for name in streams] for motion in motion_streams(5, {"white": 9}, 2)]
    assert len({number for motion in pair for number in motion}) == 2 * len(streams)
    changed = {streams[k] for m in range(2) for k in range(len(streams)) if pair[m][k] != again[m][k]}
    assert changed == {"white"}
    alone = motion_streams(5, {"white": 9}, 2)[1]["white"].random()  # before the first motion draws any
    assert again[0][streams.index("white")] != again[1][streams.index("white")] == alone


def test_a_trial_is_refused_where_the_run_of_its_seed_is(tmp_path, monkeypatch):
    wrong = Diagnosis(name="x", severity=Severity.WRONG, sentence="joints 2 and 3 are off", joints=(1, 2))
    monkeypatch.setattr(identification, "symptoms", lambda estimate, causes: Diagnosed(diagnoses=(wrong,)))
    scenario = load_scenario(str(quick_scenario(tmp_path, lasts=BRIEF)))
    refused = run(setup_of(scenario), 3).estimate.joints
    assert [each.reason for each in refused[1:3]] == [wrong.sentence] * 2
    rows = trials.run_task(
        trials.Task(scenario, (running.Trial(number=0, seed=3),), trials.trial_schema(scenario, (), ()))
    ).to_pandas()
    assert rows["identifiable"].tolist() == [isinstance(each, IdentifiedGain) for each in refused]
    assert rows["reason"][1:3].tolist() == [wrong.sentence] * 2
