"""Drive gains joint by joint, from one unloaded and one loaded motion.

Joint j's current reference is linear in its own base parameters, the payload's and 1/g_j (paper, eq. 27):

    V = [W_a  0     0           ] [chi / g   ]      V    (r,)    current reference  [drive units]
        [W_b  W_ul  W_kl chi_kl ] [chi_ul / g]      W_*  (r, .)  regressors         [SI]
                                  [1 / g     ]

Only the last column carries newton metres. Where the kinematics leave it empty, or the data leave its
coefficient uncertain, the joint is refused, with the reason and the standard deviation one would have to expect.
"""

from dataclasses import dataclass

import numpy as np

from ident.arrays import Array, Mask
from ident.base import RANK_TOL, independent_columns
from ident.errors import IdentificationError
from ident.least_squares import LeastSquares, least_squares
from ident.observation import JointObservation, Observation
from ident.payload import KnownPayload, Payload
from ident.structure import Structure


@dataclass(frozen=True, slots=True, kw_only=True)
class GainOptions:
    """When a gain counts as identifiable.

    Attributes:
        max_rel_std: Largest predicted relative standard deviation of a gain.
        noise_floor: Residual that any real drive has, as a share of the joint's rms current. A prediction never
            assumes less, so that a simulation without noise does not make a joint look identifiable.
        serial_s: Time after which residuals are taken as unrelated [s].
        rank_tol: Smallest relative singular value of the scaled observation matrix.
    """

    max_rel_std: float = 0.1
    noise_floor: float = 0.05
    serial_s: float = 1.0
    rank_tol: float = 1e-7

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            IdentificationError: If one makes no sense.
        """
        if not (
            self.max_rel_std > 0.0 and self.noise_floor >= 0.0 and self.serial_s >= 0.0 and 0.0 < self.rank_tol < 1.0
        ):
            raise IdentificationError(
                f"max_rel_std = {self.max_rel_std:g} must be positive, noise_floor = {self.noise_floor:g} and "
                f"serial_s = {self.serial_s:g} not negative, rank_tol = {self.rank_tol:g} between 0 and 1"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class JointGain:
    """The drive gain of one joint, or why there is none.

    Attributes:
        joint: Name of the joint.
        value: Joint torque per unit of current reference [N m / drive unit]; None if refused.
        std: Its standard deviation from the residual: that of eq. 20, or the one that allows for residuals
            correlated in time if it is larger; None if refused.
        payload_rel_std: Relative standard deviation from the payload's own uncertainty, not contained in `std`.
        predicted_rel_std: Relative standard deviation to expect, inf where nothing can be known.
        reason: Why the joint was refused, None if it was not.
        rows: Rows used.
        unknowns: Unknowns solved for.
        error_norm: Norm of the residual [drive units].
        current_norm: Norm of the currents [drive units].
        load_z: 1/g over its standard deviation: how visible the payload is.
        friction_z: The same for the friction coefficients over g, whose sign is that of g.
    """

    joint: str
    value: float | None
    std: float | None
    payload_rel_std: float
    predicted_rel_std: float
    reason: str | None
    rows: int
    unknowns: int
    error_norm: float
    current_norm: float
    load_z: float
    friction_z: float


@dataclass(frozen=True, slots=True)
class GainEstimate:
    """Drive gains of an arm.

    Attributes:
        method: Name of the method.
        joints: One `JointGain` a joint.
    """

    method: str
    joints: tuple[JointGain, ...]

    @property
    def identifiable(self) -> Mask:
        """Which joints have a gain, shape (n,)."""
        return np.array([joint.value is not None for joint in self.joints])

    @property
    def rows(self) -> int:
        """Rows used, all joints together."""
        return sum(joint.rows for joint in self.joints)

    @property
    def error_norm(self) -> float:
        """Norm of the residuals of all joints [drive units]."""
        return float(np.linalg.norm([joint.error_norm for joint in self.joints]))

    @property
    def rel_error_norm(self) -> float:
        """Norm of the residuals over the norm of the currents, all joints together."""
        return self.error_norm / float(np.linalg.norm([joint.current_norm for joint in self.joints if joint.rows]))

    @property
    def sigma(self) -> float:
        """Standard deviation of the residuals of all joints (eq. 19) [drive units]."""
        return self.error_norm / float(np.sqrt(self.rows - sum(joint.unknowns for joint in self.joints)))


def drive_gains(unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions) -> GainEstimate:
    """Estimate every joint's drive gain independently of the others' (paper, eq. 27).

    Args:
        unloaded: Linear system of the motion with a bare flange.
        loaded: Linear system of the motion with the payload, same structure.
        payload: What is known of the payload.
        options: When a gain counts as identifiable.

    Returns:
        A gain or a reason for each joint.
    """
    known = payload.known_part()
    joints = tuple(
        joint_gain(j, a, b, loaded.structure, known, options)
        for j, (a, b) in enumerate(zip(unloaded.joints, loaded.joints, strict=True))
    )
    return GainEstimate("ls-2011", joints)


def gain_system(
    j: int, unloaded: JointObservation, loaded: JointObservation, structure: Structure, payload: KnownPayload
) -> tuple[Array, Array, Array] | None:
    """Build the linear system of joint j (paper, eq. 27).

    Returns:
        W (r, b), its last column the torque of the known payload; V (r,); the payload's columns (r, 10), zero in
        unloaded rows. None if the kinematics let no known parameter put a torque of its own on the joint.
    """
    known, chi = payload.mask, payload.chi
    probes = structure.payload_probes[j]
    unknown = independent_columns(probes, [np.flatnonzero(~known)])
    torque = probes[:, known] @ chi[known]
    left = torque - probes[:, unknown] @ np.linalg.lstsq(probes[:, unknown], torque)[0]
    if np.linalg.norm(left) <= RANK_TOL * np.linalg.norm(probes) * np.linalg.norm(chi[known]):
        return None
    arm = np.isin(unloaded.columns, structure.joint_independent[j])
    W_L = np.vstack((np.zeros_like(unloaded.W_L), loaded.W_L))
    W = np.column_stack(
        (np.vstack((unloaded.W[:, arm], loaded.W[:, arm])), W_L[:, unknown], W_L[:, known] @ chi[known])
    )
    return W, np.concatenate((unloaded.V, loaded.V)), W_L


def joint_gain(
    j: int,
    unloaded: JointObservation,
    loaded: JointObservation,
    structure: Structure,
    payload: KnownPayload,
    options: GainOptions,
) -> JointGain:
    """Estimate the drive gain of joint j, from 0, or say why there is none (paper, eq. 27)."""
    name = structure.arm.joint_names[j]
    V = np.concatenate((unloaded.V, loaded.V))
    system = gain_system(j, unloaded, loaded, structure, payload)
    if system is None:
        what = "the payload's mass alone" if payload.names == ("M",) else "the payload"
        return _refused(name, V, f"{what} puts no torque of its own on this joint", np.inf)
    W, V, W_L = system
    try:
        fit = least_squares(W, V, rank_tol=options.rank_tol)
    except IdentificationError as error:
        return _refused(name, V, str(error), np.inf)
    inverse = float(fit.x[-1])  # 1/g, the only coefficient whose column is in newton metres
    positions = (unloaded.position, loaded.position)
    std = max(float(fit.std[-1]), fit.serial_std(-1, positions, max(1, round(options.serial_s / loaded.row_period)), W))
    floor = options.noise_floor * float(np.sqrt(np.mean(V**2) * fit.cofactor[-1, -1]))
    predicted = max(std, floor) / abs(inverse)
    sensitivity = fit.cofactor[-1] @ W.T @ W_L  # relative change of g per unit of each payload parameter, (10,)
    reason = None
    if not predicted <= options.max_rel_std:
        reason = (
            f"predicted standard deviation {_percent(predicted)} of the gain exceeds {_percent(options.max_rel_std)}; "
            f"the payload puts {np.sqrt(np.mean((W[len(unloaded.V) :, -1]) ** 2)):.3g} N m rms on this joint"
        )
    return JointGain(
        joint=name,
        value=None if reason else 1.0 / inverse,
        std=None if reason else std / inverse**2,  # g = 1/x: std(g) = g^2 std(x)
        payload_rel_std=float(np.linalg.norm(sensitivity @ payload.spread)),
        predicted_rel_std=predicted,
        reason=reason,
        rows=len(V),
        unknowns=W.shape[1],
        error_norm=float(np.linalg.norm(fit.residual)),
        current_norm=float(np.linalg.norm(V)),
        load_z=inverse / std,
        friction_z=_friction_z(fit, unloaded, structure, j),
    )


def _friction_z(fit: LeastSquares, unloaded: JointObservation, structure: Structure, j: int) -> float:
    """Friction torque over g at typical speed, over its standard deviation."""
    weight = np.zeros(len(fit.x))
    base = structure.base.names
    names = [base[c] for c in unloaded.columns if c in structure.joint_independent[j]]
    for k, name in enumerate(names):
        if name in (f"Fv{j + 1}", f"Fc{j + 1}"):
            weight[k] = np.linalg.norm(unloaded.W[:, list(unloaded.columns).index(structure.joint_independent[j][k])])
    return float(weight @ fit.x / np.sqrt(weight @ fit.covariance @ weight))


def _refused(name: str, V: Array, reason: str, predicted: float) -> JointGain:
    norm = float(np.linalg.norm(V))
    return JointGain(
        joint=name,
        value=None,
        std=None,
        payload_rel_std=0.0,
        predicted_rel_std=predicted,
        reason=reason,
        rows=0,
        unknowns=0,
        error_norm=0.0,
        current_norm=norm,
        load_z=0.0,
        friction_z=0.0,
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
