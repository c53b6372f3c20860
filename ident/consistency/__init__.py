"""Consistency tests of an estimate: functions `(evidence) -> finding or None`, by name.

None is said of what the data cannot show at all. A finding has its statistic whether it fails or not; its sentence is
what a user is told.
"""

from collections.abc import Callable, Mapping
from typing import TypeAlias

from ident.consistency.bare import check_bare
from ident.consistency.centre import check_centre
from ident.consistency.curves import check_position, check_speed
from ident.consistency.elasticity import check_elasticity
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.halves import check_halves
from ident.consistency.joints import check_joints
from ident.consistency.single_load import check_single_load
from ident.consistency.whiteness import check_whiteness

Check: TypeAlias = Callable[[Evidence], Finding | None]

CHECKS: dict[str, Check] = {
    "elasticity": check_elasticity,
    "load friction": check_single_load,
    "joints": check_joints,
    "centre": check_centre,
    "halves": check_halves,
    "bare": check_bare,
    "position": check_position,
    "speed": check_speed,
    "whiteness": check_whiteness,
}
"""What each looks at.

`elasticity`, `load friction`: an error of the model that no residual shows; `joints`: each alone against all together;
`centre`: the payload's centre of mass against what is left; `halves`: the first half of every motion against the
second; `bare`: motions with a bare flange against each other; `position`, `speed`: what is left against a joint's own;
`whiteness`: what is left against itself in time.
"""
REFUSING: dict[str, Check] = {"joints": check_joints}
"""Those whose failure costs every gain; for studies, whose trials may not claim what a run of their seed refuses."""
UNCHECKED: dict[str, Check] = {}
"""For who asks for gains alone."""


def findings(evidence: Evidence, checks: Mapping[str, Check] = CHECKS) -> tuple[Finding, ...]:
    """What the tests find; nothing where a joint's current is explained to the last digit, which no recording is."""
    if not (evidence.sigma > 0.0).all():
        return ()
    found = (check(evidence) for check in checks.values())
    return tuple(each for each in found if each is not None)
