"""Scenarios in Python: load, simulate, run, repeat and sweep them."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ident.model.arm import Arm
from scenarios.experiments.run import Run, Simulated, run, simulate
from scenarios.experiments.scenario import Setup, Value, load_scenario, setup_of
from scenarios.experiments.workers import Workers

if TYPE_CHECKING:
    from scenarios.experiments.study import StudyRows


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

        Raises `SimulationError` if a motion cannot be carried out, `IdentificationError` if there is no gain.
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

    Raises `ScenarioError` if it is missing, has an unknown key or a wrong value, or names what does not exist,
    `SimulationError` if robot or plant are not valid, `RobotModelError` if the robot's model file is not an arm.
    """
    return LoadedScenario(setup_of(load_scenario(str(name))))
