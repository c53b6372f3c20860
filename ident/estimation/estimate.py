"""What identification found, with what proves it: a gain or a reason a joint, rows, residuals, influence."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.estimation.gain_options import GainOptions
from ident.estimation.rows import Rows
from ident.support.arrays import Array, Indices, Mask, MaskedArray


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedGain:
    """The drive gain of one joint.

    Attributes:
        joint: Name of the joint.
        value: Joint torque per unit of current reference [N m / drive unit].
        residual_std: Share of its standard deviation from the residuals [N m / drive unit].
        payload_rel_std: Share from the payload's own uncertainty, relative.
        model_rel_std: Share from what the model takes for granted, relative.
        predicted_rel_std: Relative standard deviation to expect of data like these, never less than `residual_std`
            implies.
    """

    joint: str
    value: float
    residual_std: float
    payload_rel_std: float
    model_rel_std: float
    predicted_rel_std: float

    @property
    def payload_std(self) -> float:
        """Standard deviation from the payload's own uncertainty [N m / drive unit]."""
        return self.payload_rel_std * abs(self.value)

    @property
    def model_std(self) -> float:
        """Standard deviation from what the model takes for granted [N m / drive unit]."""
        return self.model_rel_std * abs(self.value)

    @property
    def std(self) -> float:
        """Standard deviation from residuals, payload and model together [N m / drive unit]."""
        return float(np.linalg.norm((self.residual_std, self.payload_std, self.model_std)))


@dataclass(frozen=True, slots=True, kw_only=True)
class RefusedGain:
    """A joint whose gain the data cannot give.

    Attributes:
        joint: Name of the joint.
        reason: Why.
        predicted_rel_std: Relative standard deviation to expect of its gain, None where nothing can be known.
    """

    joint: str
    reason: str
    predicted_rel_std: float | None


JointResult = IdentifiedGain | RefusedGain


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundParameter:
    """An inertial parameter of the payload that an estimator found on its way, at the origin of the last frame.

    Attributes:
        name: One of `INERTIAL`.
        value: Estimate [kg m^2, kg m or kg].
        std: Its standard deviation, that of the gains included.
    """

    name: str
    value: float
    std: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadFriction:
    """Coefficients of friction in proportion to the load, and how gains depend on them.

    Attributes:
        std: Standard deviation of each joint's coefficient, shape (k,).
        slope: Relative change of each gain per unit of its own joint's coefficient, shape (k,).
    """

    std: Array
    slope: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainSolution:
    """What an estimator hands over: 1/g of k joints as a function of the currents, before it is judged.

    Attributes:
        rows: Rows it was found from, with their residuals, r of the k joints (or of more).
        joints: The k joints, from 0, shape (k,).
        inverse: 1/g, shape (k,).
        influence: Derivative of each 1/g by the current of each row, shape (k, r).
        payload: Relative change of each gain per deviation of what is stated of the payloads, shape (k, p).
        model: Relative change of each gain per deviation of what the model takes for granted, shape (k, m).
        load_rms: Root mean square of the known payload's torque on each joint [N m], shape (k,).
        friction: Friction torque over g at typical speed, and the dry part of it alone, whose sign is that of g, shape
            (k, 2).
        friction_influence: Its derivative by the current of each row, shape (k, 2, r).
        unsolved: Why the other joints have no 1/g at all, by joint.
        softened: Change of each row's current if joints were as soft as drives may be [drive units], shape (r,); None
            if it was not found.
        load_friction: What friction in proportion to the load does to gains that were found beside it; None if it was
            not.
        stiff: The same of a model without yielding joints, where data chose these, so that a fault that they imitate
            can be told; None where they did not.
    """

    rows: Rows
    joints: Indices
    inverse: Array
    influence: Array
    payload: Array
    model: Array
    load_rms: Array
    friction: Array
    friction_influence: Array
    unsolved: Mapping[int, str]
    softened: Array | None = None
    load_friction: LoadFriction | None = None
    stiff: "GainSolution | None" = None

    @property
    def payload_rel_std(self) -> Array:
        """Relative standard deviation of each gain from what is stated of the payloads, shape (k,)."""
        return np.linalg.norm(self.payload, axis=1)

    @property
    def model_rel_std(self) -> Array:
        """Relative standard deviation of each gain from what the model takes for granted, shape (k,)."""
        return np.linalg.norm(self.model, axis=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GainEstimate:
    """Drive gains of an arm, and what proves them.

    Attributes:
        method: Name of the method.
        joints: One result a joint.
        solution: Rows, residuals and the influence of each row.
        covariance: Of the k values 1/g of the solution, from the residuals, shape (k, k).
        options: What decided about covariance and refusals.
        payload: Payload parameters that the method found on its way.
        remarks: What the method decided on its way, in words.
    """

    method: str
    joints: tuple[JointResult, ...]
    solution: GainSolution
    covariance: Array
    options: GainOptions
    payload: tuple[FoundParameter, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def identifiable(self) -> Mask:
        """Which joints have a gain, shape (n,)."""
        return np.array([isinstance(joint, IdentifiedGain) for joint in self.joints])

    @property
    def gain(self) -> MaskedArray:
        """The gains [N m / drive unit], shape (n,), masked where refused."""
        return self._each("value")

    @property
    def std(self) -> MaskedArray:
        """Standard deviations from residuals, payload and model together, shape (n,), masked where refused."""
        return self._each("std")

    @property
    def residual_std(self) -> MaskedArray:
        """Standard deviations from the residuals, shape (n,), masked where refused."""
        return self._each("residual_std")

    @property
    def payload_std(self) -> MaskedArray:
        """Standard deviations from the payload's own uncertainty, shape (n,), masked where refused."""
        return self._each("payload_std")

    @property
    def model_std(self) -> MaskedArray:
        """Standard deviations from what the model takes for granted, shape (n,), masked where refused."""
        return self._each("model_std")

    @property
    def reasons(self) -> tuple[str | None, ...]:
        """Why each joint is refused, None where it has a gain."""
        return tuple(None if isinstance(joint, IdentifiedGain) else joint.reason for joint in self.joints)

    def _each(self, name: str) -> MaskedArray:
        """A number of every joint's gain, shape (n,), masked where refused."""
        numbers = [getattr(joint, name) if isinstance(joint, IdentifiedGain) else 0.0 for joint in self.joints]
        return np.ma.array(numbers, mask=~self.identifiable, dtype=np.float64)

    @property
    def rows(self) -> int:
        """Rows used, all joints together."""
        return len(self.solution.rows.V)

    @property
    def error_norm(self) -> float:
        """Norm of the residuals of all joints [drive units]."""
        return float(np.linalg.norm(self.solution.rows.residual))

    @property
    def rel_error_norm(self) -> float:
        """Norm of the residuals over the norm of the currents, all joints together."""
        return self.error_norm / float(np.linalg.norm(self.solution.rows.V))

    @property
    def sigma(self) -> float:
        """Standard deviation of the residuals of all joints (eq. 19) [drive units]."""
        rows = self.solution.rows
        return self.error_norm / float(np.sqrt(len(rows.V) - sum(rows.unknowns.values())))

    def residual_share(self, joint: int) -> float | None:
        """Norm of a joint's residual over that of its currents, None if no row of the joint (from 0) was used."""
        rows = self.solution.rows
        return rows.residual_share(joint) if joint in rows.unknowns else None
