"""A scenario from Python: `load` it, simulate it, run it, repeat it, sweep it."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from ident.model.arm import Arm
from scenarios.experiments.build import Setup, setup_of
from scenarios.experiments.files.loading import load_scenario
from scenarios.experiments.files.settings import Value
from scenarios.experiments.run import Run, Simulated, run, simulate
from scenarios.experiments.studies.monte_carlo import monte_carlo, sweep
from scenarios.experiments.studies.study import StudyRows, study_rows_of
from scenarios.experiments.workers.kinds import Workers


@dataclass(frozen=True, slots=True, eq=False)
class LoadedScenario:
    """A scenario, ready to be simulated and identified.

    The same seed gives the same bytes, whatever is called: `exp.simulate(3)` logs what `exp.run(3)`, trial 3 of
    `exp.monte_carlo(4)` and `rx90 run --seed 3` identify from.

    Attributes:
        setup: Everything it needs to run.
    """

    setup: Setup

    @property
    def arm(self) -> Arm:
        """The arm as identification knows it: kinematics, without truth."""
        return self.setup.structure.arm

    def simulate(self, seed: int = 0) -> Simulated:
        """Record the motions: `logs` for `ident.identify`, `truth.gain` to hold the gains against.

        Args:
            seed: Seed of every random number.

        Raises:
            ScenarioError: If a random setting cannot be drawn or does not fit.
            SimulationError: If a motion cannot be carried out.
        """
        return simulate(self.setup, seed)

    def run(self, seed: int = 0) -> Run:
        """Simulate, identify as the scenario says, and judge.

        Args:
            seed: Seed of every random number.

        Raises:
            ScenarioError: If a random setting cannot be drawn or does not fit.
            SimulationError: If a motion cannot be carried out.
            IdentificationError: If the recordings cannot be identified at all.
        """
        return run(self.setup, seed)

    def monte_carlo(
        self, count: int, *, seed: int = 0, workers: AbstractContextManager[Workers] | None = None
    ) -> StudyRows:
        """Repeat it with seeds that count up, everything that it declares random drawn anew.

        Args:
            count: Number of trials.
            seed: Of the first.
            workers: Where trials run, as `local_processes(4)` or `dask_workers(address)`; here, if None. Rows do not
                depend on it.

        Raises:
            StudyError: If there are not that many seeds.
            ScenarioError: If the scenario's draws are wrong.
        """
        return study_rows_of(monte_carlo(self.setup.scenario, count, seed), workers)

    def sweep(
        self,
        values: Mapping[str, Sequence[Value]],
        *,
        seeds: int | Iterable[int],
        workers: AbstractContextManager[Workers] | None = None,
    ) -> StudyRows:
        """Run it with every combination of some values, and the same seeds each time.

        Args:
            values: Values to try by place, as `{"plant.payload.mass": [6.0, 7.0]}`; the end of a place is enough where
                no other place ends so.
            seeds: Of the trials of each combination; a number n stands for 0 to n - 1.
            workers: As of `monte_carlo`.

        Raises:
            ScenarioError: If a place does not exist, or several end so; if a place does not take a value, or the
                scenario's draws are wrong.
        """
        return study_rows_of(sweep(self.setup.scenario, values, seeds), workers)


def load(name: str | Path) -> LoadedScenario:
    """Load a scenario.

    Args:
        name: A built-in one, or the path of a TOML file.

    Raises:
        ScenarioError: If it is missing, has an unknown key or a wrong value, or names what does not exist.
        SimulationError: If robot or plant are impossible.
        RobotModelError: If the robot's model file is no arm.
    """
    return LoadedScenario(setup_of(load_scenario(str(name))))
