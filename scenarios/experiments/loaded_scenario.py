"""Scenarios in Python: load, simulate, run, repeat and sweep them, and assert their accuracy in a pytest suite."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING

from ident.model.arm import Arm
from scenarios.experiments.run import Run, Simulated, run, simulate
from scenarios.experiments.scenario import Setup, Value, load_scenario, setup_of
from scenarios.experiments.scenario_files import SEEDS
from scenarios.experiments.workers import Workers
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.experiments.statistics import JointStatistics
    from scenarios.experiments.study import StudyRows

POWER = 0.95
"""Probability with which the stated pass rate is detected."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LoadedScenario:
    """A scenario that is ready for simulation and identification; `setup` has all inputs for running it.

    The same seed gives the same bytes in every function: `exp.run(3)`, trial 3 of `exp.monte_carlo(4)` and `rx90 run
    --seed 3` use the logs of `exp.simulate(3)`. Every function raises `ScenarioError` if a random setting cannot be
    drawn or is not valid, and without an estimate as `run`.
    """

    setup: Setup

    def __repr__(self) -> str:
        """Return its name, robot and motions."""
        motions = ", ".join(f"{each.trajectory.duration:g} s" for each in self.setup.experiments)
        return f"Scenario {self.setup.scenario.name} of {self.arm.name}: motions of {motions}"

    @property
    def arm(self) -> Arm:
        """The arm for identification: its kinematics, without true parameters."""
        return self.setup.structure.arm

    def simulate(self, seed: int = 0) -> Simulated:
        """Simulate the motions: `logs` for `ident.identify`, and `truth.gain` for comparison; raises as `run`."""
        return simulate(self.setup, seed)

    def run(self, seed: int = 0) -> Run:
        """Simulate, identify with the scenario's method, and judge.

        Raises:
            SimulationError: If a motion cannot be carried out.
            IdentificationError: If no gain can be identified.
        """
        return run(self.setup, seed)

    def monte_carlo(
        self, count: int, *, seed: int = 0, workers: AbstractContextManager[Workers] | None = None
    ) -> "StudyRows":
        """Repeat the scenario `count` times with consecutive seeds from `seed` and new random values.

        Results do not depend on workers: None is this process; or `local_processes(4)`, `dask_workers(address)`.
        """
        from scenarios.experiments.study import monte_carlo, study_rows_of  # studies need the extra of their name

        return study_rows_of(monte_carlo(self.setup.scenario, count, seed), workers)

    def sweep(
        self,
        values: Mapping[str, Sequence[Value]],
        *,
        seeds: int | Iterable[int],
        workers: AbstractContextManager[Workers] | None = None,
    ) -> "StudyRows":
        """Run the scenario with every combination of some values, with the same seeds each time.

        Args:
            values: Values by key path, as `{"plant.payload.mass": [6.0, 7.0]}`; a unique end of a path is enough.
            seeds: Seeds of the trials of each combination; a number n means 0 to n - 1.
            workers: As in `monte_carlo`.

        Raises:
            ScenarioError: If a key path does not exist or is ambiguous, or a value is not valid.
        """
        from scenarios.experiments.study import study_rows_of, sweep

        return study_rows_of(sweep(self.setup.scenario, values, seeds), workers)


def load(name: str | Path) -> LoadedScenario:
    """Load a built-in scenario or a TOML file.

    Raises:
        ScenarioError: If it is missing, has an unknown key or a wrong value, or names what does not exist.
        SimulationError: If robot or plant are not valid.
        RobotModelError: If the robot's model file is not an arm.
    """
    return LoadedScenario(setup_of(load_scenario(str(name))))


def assert_scenario(scenario: str, seeds: Iterable[int], *, false_alarm: float = 0.01) -> "tuple[JointStatistics, ...]":
    """Assert that every joint passes as often as the scenario's `tolerance.pass_rate` requires.

    Misses are compared with the binomial distribution at that rate, joint by joint: a scenario with this rate on all
    joints fails for less than `false_alarm` of all choices of seeds. With fixed seeds the outcome is always the same.

    Args:
        scenario: A built-in name or the path of a TOML file.
        seeds: Seeds, with one trial each, as in `rx90 run --seed`.
        false_alarm: Largest false-alarm rate.

    Returns:
        The result of each joint, if all pass.

    Raises:
        AssertionError: If a joint fails; the message names joints, misses, worst trial and detectable pass rate.
        ScenarioError: If the scenario is wrong, or there are no seeds or too few for any failure.
    """
    from scenarios.experiments.statistics import allowed_misses, detectable_rate, joint_statistics, study_rows
    from scenarios.experiments.study import study_rows_of, sweep

    checked, loaded = list(seeds), load_scenario(scenario)
    wanted, joints, count = loaded.table.tolerance.pass_rate, len(loaded.table.tolerance.gain), len(checked)
    odd = [k for k in checked if isinstance(k, bool) or not hasattr(k, "__index__") or not 0 <= k < SEEDS]
    for wrong, said in (
        (not checked, "give at least one seed"),
        (odd, f"seed {odd[:1]}: expected a whole number from 0 to 2^31 - 1"),
        (len(set(checked)) < count, "a seed is given twice; a repeated trial adds no information"),
        (not 0.0 < false_alarm < 1.0, f"false_alarm = {false_alarm}: expected a rate between 0 and 1"),
    ):
        if wrong:
            raise ScenarioError(said)
    if allowed_misses(count, wanted, false_alarm / joints) >= count:
        many = "1 seed" if count == 1 else f"{count} seeds"
        raise ScenarioError(f"{loaded.name}: {many} cannot reject a pass rate of {wanted:g}; run more seeds")
    rows = study_rows_of(sweep(loaded, {}, map(index, checked))).rows
    found = joint_statistics(study_rows([rows]).joints, wanted=wanted, false_alarm=false_alarm)
    missed = [joint for joint in found if not joint.held]
    if not missed:
        return found
    many = "1 joint passes" if len(missed) == 1 else f"{len(missed)} joints pass"
    lines, trials = [f"scenario {loaded.name}: {many} less often than required"], rows.to_pandas()
    for rule in missed:
        failing = trials[(trials["joint"] == rule.joint) & ~trials["passed"]]
        worst = failing.loc[failing["rel_error"].abs().fillna(float("inf")).idxmax()]
        lines.append(
            f"  joint {rule.joint}: {rule.trials - rule.passed} of {rule.trials} trials failed, {rule.allowed} allowed "
            f"at a pass rate of {rule.wanted:g}; seed {worst['seed']}: {worst['reason']}"
        )
    rate = detectable_rate(count, missed[0].allowed, POWER)
    lines.append(f"  ({count} seeds detect a pass rate below {rate:.2f} in {100 * POWER:g} % of cases)")
    raise AssertionError("\n".join(lines))
