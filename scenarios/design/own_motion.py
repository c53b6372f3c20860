"""The motion that a scenario has already: where a search may begin, and what it should not end behind."""

from dataclasses import dataclass

from scenarios.design.excitation import Design
from scenarios.design.search import Series
from scenarios.experiments.files.motions import read_motion
from scenarios.experiments.files.schema import Scenario
from scenarios.support.errors import ScenarioError
from sim.trajectory import FourierTrajectory


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnMotion:
    """A scenario's motion as a solution of its design problem.

    Attributes:
        motion: The motion.
        cost: What it costs.
        worst: Largest predicted deviation of a wanted gain.
    """

    motion: FourierTrajectory
    cost: float
    worst: float

    def better_than(self, motion: FourierTrajectory, design: Design) -> bool:
        """Whether it shows the wanted gains better than another motion."""
        return self.cost < design.cost(motion)


def own_motion(scenario: Scenario, design: Design) -> OwnMotion | None:
    """The motion of a scenario; None where there is none yet, or none that this robot can make."""
    try:
        motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    except ScenarioError:
        return None
    if motion.n != design.problem.plant.robot.n or not design.keeps_limits(motion):
        return None
    return OwnMotion(motion=motion, cost=design.cost(motion), worst=worst_deviation(design, motion))


def worst_deviation(design: Design, motion: FourierTrajectory) -> float:
    """Largest predicted relative deviation of a wanted gain."""
    return float(design.deviations(design.rows(motion)).total[design.problem.joints].max())


def first_motion(scenario: Scenario, series: Series) -> FourierTrajectory:
    """The motion of a scenario, for a search to begin with.

    Raises:
        ScenarioError: If no point of the series is that motion; if there is none.
    """
    motion = read_motion(scenario.table.experiment.motion, scenario.folder)
    n, harmonics = motion.sine.shape
    if n != series.n or harmonics > series.harmonics or motion.duration != series.duration:
        raise ScenarioError(
            f"{scenario.name}: motion {scenario.table.experiment.motion!r} has {harmonics} harmonics of {n} joints in "
            f"{motion.duration:g} s; to improve it, search with --duration {motion.duration:g} and --harmonics "
            f"{harmonics} or more, on an arm of {n} joints"
        )
    return motion
