"""Masses that joints alone find, as a verification holds them against a scale."""

import numpy as np

from ident.parameters.payload import FoundBody
from ident.parameters.weighing import AGREES, DIFFERS, Verification, Weighed
from ident.payload.payload import Payload

STATED, SCALE = 7.3, 0.002


def mass(rel_error: float, rel_std: float, gain_share: float = 0.0) -> dict[str, float]:
    shares = {"residual_std": STATED * rel_std, "gain_std": STATED * gain_share, "model_std": 0.0}
    return {"mass": STATED * (1.0 + rel_error), "std": float(np.linalg.norm(list(shares.values()))), **shares}


def weighing(
    *errors: float | None,
    stds: float | tuple[float, ...] = 0.01,
    gain_share: float | tuple[float, ...] = 0.0,
    scale: float = SCALE,
) -> Verification:
    """What a verification finds where joints alone are off by so much, 2.7 deviations being too much."""
    each, shares = (np.broadcast_to(values, len(errors)).tolist() for values in (stds, gain_share))
    joints = tuple(
        Weighed(joint=j, reason="it is weak")
        if off is None
        else Weighed(
            joint=j,
            **mass(off, std, share),
            rel_error=off,
            rel_std=float(np.hypot(std, scale)),
            verdict=DIFFERS if abs(off) > 2.7 * np.hypot(std, scale) else AGREES,
        )
        for j, (off, std, share) in enumerate(zip(errors, each, shares, strict=True))
    )
    known = [off for off in errors if off is not None]
    return Verification(
        payload=Payload(mass=STATED, mass_std=STATED * scale, known="mass"),
        together=Weighed(joint=None, **mass(known[0], 0.01), rel_error=known[0], rel_std=0.01, verdict=DIFFERS),
        joints=joints,
        body=FoundBody(quantities=(), refused={}, possible=None),
        limit=2.7,
        remarks=(),
    )
