"""FIGAROH's total least squares with a known payload, as a method: `docs.adapters.figaroh_tls:drive_gains`.

    pip install figaroh==1.0.2
    rx90 compare nominal --method docs.adapters.figaroh_tls:drive_gains -n 5 --out compared

`build_total_regressor_current` takes base regressors of a bare and a loaded motion, currents and the payload's columns,
of which the last is scaled by a mass. The rows are those of every method here, filters and all; what is known of the
payload is its torque over its mass. Deviations are those of `relative_stdev`, FIGAROH's of ordinary least squares.

What FIGAROH lacks: weights of rows and columns; more than one bare and one loaded motion, of equally many rows (here
the first of each, cut to the shorter); a deviation of total least squares, and one below 0.01 %; a share of the
payload's own deviation; a rule of refusal (here `max_rel_std` of the problem, held against the deviations it states).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.model.parameters import INERTIAL
from ident.model.structure import Structure, structure_of
from ident.observation.observation import observe
from ident.payload.payload import Payload
from ident.recordings.recording import Motion
from ident.support.arrays import Array
from scenarios.results.problem_folder import GivenProblem

try:
    from figaroh.identification.identification_tools import relative_stdev
    from figaroh.tools.regressor import build_total_regressor_current
except ImportError as error:
    raise ImportError("FIGAROH or what it needs is missing; pip install figaroh==1.0.2") from error

EVERY_ROW = -1.0
"""As `min_weight`: rows that lose much to reversals weigh little, and count; FIGAROH wants as many of each joint."""
LEAST = 5e-5
"""Smallest relative deviation that FIGAROH's rounding to 0.01 % tells from none."""


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """All joints of one motion, each r rows: currents (n, r), base columns (n, r, b), payload columns (n, r, 10)."""

    V: Array
    W: Array
    W_L: Array


def drive_gains(problem: GivenProblem) -> Sequence[Mapping[str, object]]:
    """Find the gains of a problem, and refuse those with a deviation above its `max_rel_std`.

    Args:
        problem: One bare motion and one with a payload are used.

    Returns:
        For each joint `estimate` and `std` [N m / drive unit], or a `reason`.
    """
    return _stated(problem, problem.gains.max_rel_std)


def every_gain(problem: GivenProblem) -> Sequence[Mapping[str, object]]:
    """As `drive_gains`, with whatever FIGAROH states, as it refuses nothing itself."""
    return _stated(problem, np.inf)


def _stated(problem: GivenProblem, most: float) -> Sequence[Mapping[str, object]]:
    n = problem.arm.n
    bare = next((each for each in problem.motions if each.payload is None), None)
    loaded = next((each for each in problem.motions if each.payload is not None), None)
    if bare is None or loaded is None or loaded.payload is None or loaded.payload.known == "none":
        return [{"reason": "a bare motion and one with a payload of known mass are needed"}] * n
    structure = structure_of(problem.arm)
    rows = [_rows(problem, structure, each) for each in (bare, loaded)]
    r = min(each.V.shape[1] for each in rows)
    W_u, W_l = (each.W[:, :r].reshape(n * r, -1) for each in rows)
    W_tot, x, _ = build_total_regressor_current(
        W_u,
        W_l,
        _payload_columns(rows[1].W_L[:, :r].reshape(n * r, -1), loaded.payload),
        *(each.V[:, :r].ravel() for each in rows),
        dict.fromkeys(INERTIAL, 0.0),
        {
            "nb_samples": r,
            "has_friction": False,  # friction and rotors are among the base columns
            "has_actuator_inertia": False,
            "which_body_loaded": 0,
            "mass_load": loaded.payload.mass,
        },
    )
    gains = slice(W_u.shape[1], W_u.shape[1] + n)
    share = relative_stdev(W_tot[:, :-1], x[:-1], -loaded.payload.mass * W_tot[:, -1]) / 100.0
    return [_gain(*pair, most) for pair in zip(x[gains].tolist(), share[gains], strict=True)]


def _rows(problem: GivenProblem, structure: Structure, motion: Motion) -> _Rows:
    observed = observe(motion.recording, structure, replace(problem.observing, min_weight=EVERY_ROW))
    joints = observed.joints
    W = np.zeros((len(joints), len(joints[0].V), len(structure.base.columns)))
    for j, joint in enumerate(joints):
        W[j][:, joint.columns] = joint.W
    return _Rows(
        np.array([joint.V for joint in observed.joints]), W, np.array([joint.W_L for joint in observed.joints])
    )


def _payload_columns(W_L: Array, payload: Payload) -> Array:
    """Columns of what is unknown of the payload, and the torque of what is known over its mass, shape (r, 10)."""
    known = payload.known_part()
    columns = np.where(known.mask, 0.0, W_L)
    columns[:, -1] = W_L[:, known.mask] @ known.chi[known.mask] / payload.mass
    return columns


def _gain(gain: float, share: float, most: float) -> Mapping[str, object]:
    if not share <= most or not np.isfinite(share):
        return {"reason": f"relative deviation {100.0 * share:.3g} % exceeds {100.0 * most:g} %"}
    return {"estimate": gain, "std": abs(gain) * max(float(share), LEAST)}
