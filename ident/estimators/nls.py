"""Drive gains of all joints at once: shared links, own friction in current units, logarithms of the gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j with h = 1/g, rows weighted by each joint's own residual. Links that several
joints feel tie the gains of these joints together, so that a joint that the known payload hardly loads is found
through its neighbours.
"""

from dataclasses import dataclass, field

from ident.all_joints.model import FRICTIONS, OwnModel
from ident.all_joints.solution import solved
from ident.conclusion import concluded
from ident.errors import OptionError
from ident.estimate import GainEstimate
from ident.options import NAMES, check_range
from ident.problem import Problem

NAME = "nls"


@dataclass(frozen=True, slots=True, kw_only=True)
class AllJointsOptions:
    """Options of `nls`.

    Attributes:
        friction: Friction of every joint besides viscous and Coulomb.
        friction_per_motion: Whether viscous and Coulomb friction differ between motions.
        compliance: Whether joints yield, one compliance each.
        prior_std: Deviation of log|1/g| that is allowed around the start: keeps a joint finite that nothing loads.
    """

    friction: str = field(default="viscous-coulomb", metadata={NAMES: FRICTIONS})
    friction_per_motion: bool = True
    compliance: bool = False
    prior_std: float = 1.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OptionError: If one makes no sense.
        """
        if self.friction not in FRICTIONS:
            raise OptionError(f"friction = {self.friction!r}: expected one of {', '.join(FRICTIONS)}")
        check_range("prior_std", self.prior_std, above=0.0, upto=100.0)


def all_joints_gains(problem: Problem, options: AllJointsOptions) -> GainEstimate:
    """Estimate the gains of all joints together.

    Args:
        problem: Motions, bare and with any number of mountings, whose payloads are known in full or in part.
        options: Friction and what else the model holds.

    Returns:
        A gain or a reason for each joint.

    Raises:
        NotIdentifiable: If nothing sets the scale of the gains.
        TooFewRows: If a joint has fewer rows than unknowns.
        NotConverged: If no end is found.
    """
    model = OwnModel(
        friction=FRICTIONS[options.friction],
        per_motion=options.friction_per_motion,
        compliance=options.compliance,
        prior_std=options.prior_std,
    )
    return concluded(NAME, problem, solved(problem, model))
