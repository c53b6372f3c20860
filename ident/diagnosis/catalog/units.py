"""Positions in other units than radians and metres, or on the motor side of a gear."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.diagnosis.alternative import Alternative, in_logs, scopes
from ident.diagnosis.joint_limits import beyond_limits, within_limits
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

ANGLES = {"degrees": np.pi / 180.0, "revolutions": 2.0 * np.pi, "milliradians": 1e-3}
"""Factors from units of angle to radians."""
LENGTHS = {"millimetres": 1e-3}
"""Factors from units of length to metres."""
RATIOS = np.geomspace(2.0, 500.0, 280)
"""Plausible gear ratios, 2 % apart; a planetary stage has 3, a harmonic drive up to 320."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Positions of all joints or of one in another unit, in all logs or one, if they are then within the limits."""
    arm = logs.structure.arm
    for kind, units in ((arm.revolute, ANGLES), (~arm.revolute.astype(bool), LENGTHS)):
        joints = np.flatnonzero(kind)
        for name, factor in units.items():
            chosen = [tuple(joints.tolist())] if len(joints) > 1 else []
            for which in [*chosen, *((int(j),) for j in joints)]:
                for scope in scopes(len(logs.recordings)):
                    found = in_unit(logs, scope, which, factor, f"in {name}")
                    if all(within_limits(arm, logs.recordings[k], found.hypothesis.logs[k]) for k in scope):
                        yield found
    beyond = {j for log in logs.recordings for j in beyond_limits(arm, log)}
    if len(beyond) == 1 and arm.revolute[min(beyond)]:  # the ratios of several joints cannot be found separately
        yield from gears(logs, min(beyond))


def gears(logs: Logs, joint: int) -> Iterator[Alternative]:
    """Positions of one joint on the motor side, for every plausible ratio and both signs."""
    for ratio in np.concatenate((RATIOS, -RATIOS)).tolist():
        yield geared(logs, logs.every, joint, ratio)


def geared(logs: Logs, scope: tuple[int, ...], joint: int, ratio: float) -> Alternative:
    """Return positions of a joint on the motor side of a gear."""
    found = in_unit(logs, scope, (joint,), 1.0 / ratio, f"on the motor's side of a gear of ratio {ratio:.4g}")

    def refined(more: Array) -> Alternative:
        return geared(logs, scope, joint, ratio * (1.0 + float(more[0])))

    return replace(found, value=ratio, refined=refined, searched=True)


def in_unit(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], factor: float, words: str) -> Alternative:
    """Return positions of some joints times a factor."""
    arm = logs.structure.arm
    every = len(joints) == int(np.sum(arm.revolute == arm.revolute[min(joints)])) and len(joints) > 1
    first = min(joints)
    what = "all positions are" if every else f"q{first + 1} is"
    return Alternative(
        family="unit",
        words=in_logs(f"{what} {words}", scope, logs.names),
        joints=() if every else joints,
        logs=scope,
        hypothesis=logs.given.changed(scope, q_factor=np.where([j in joints for j in range(arm.n)], factor, 1.0)),
        advice="convert the positions to radians and metres of the joints",
    )
