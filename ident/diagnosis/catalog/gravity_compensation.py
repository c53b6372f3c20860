"""Currents from which a controller has taken out what gravity asks for."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.diagnosis.alternative import Alternative
from ident.diagnosis.hypothesis import as_logged
from ident.diagnosis.logs import Logs


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Links and payload that weigh nothing."""
    arm, count = logs.structure.arm, len(logs.recordings)
    if arm.gravity.any():
        yield Alternative(
            family="gravity compensation",
            words="v is gravity-compensated: it lacks the weight of links and payload",
            joints=(),
            logs=tuple(range(count)),
            hypothesis=replace(as_logged(arm, count), gravity=np.zeros(3)),
            advice="log the motor current, or the whole commanded torque",
        )
