"""Input of an estimator: the arm's structure, the motions with their payloads, and options; its rows, stacked."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Annotated

import numpy as np
from annotated_types import Interval

from ident.estimation.intervals import UNCERTAINTIES
from ident.model.parameters import INERTIAL
from ident.model.structure import Structure, independent_columns
from ident.observation.observation import Observation
from ident.payload.payload import KnownPayload, Payload
from ident.support.arrays import Array, Indices, Mask
from ident.support.errors import NotIdentifiable, OptionError
from ident.support.options import NAMES, refuse_outside, unknown_name

OWN = ("Fv", "Fc", "off")
"""Parameters that act on one joint only; they are estimated in drive units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GainOptions:
    """Required accuracy of a gain, and estimation of its uncertainty.

    Attributes:
        max_rel_std: Largest predicted relative standard deviation of a gain that is not refused.
        noise_floor: Residual that any real drive has, as a share of the joint's rms current. A prediction never
            assumes less, so that a simulation without noise does not make a joint look identifiable.
        rank_tol: Smallest relative singular value of the scaled observation matrix.
        uncertainty: Method that estimates the covariance.
    """

    max_rel_std: Annotated[float, Interval(gt=0.0, le=1e6)] = 0.1
    noise_floor: Annotated[float, Interval(ge=0.0, le=1e3)] = 0.05
    rank_tol: Annotated[float, Interval(gt=0.0, lt=1.0)] = 1e-7
    uncertainty: str = field(default="cautious", metadata={NAMES: UNCERTAINTIES})

    def __post_init__(self) -> None:
        """Check the values; raises `OptionError`."""
        refuse_outside(self, OptionError)
        if self.uncertainty not in UNCERTAINTIES:
            raise unknown_name("uncertainty", self.uncertainty, UNCERTAINTIES)


@dataclass(frozen=True, slots=True, kw_only=True)
class NoOptions:
    """Options of a method that has none of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class ObservedMotion:
    """One motion: its linear system and its payload."""

    observation: Observation  # its linear system
    # the specified payload, None for a bare flange; Motions with one mounting share the object; two equal objects are
    # two mountings, each with its own unknown parameters:
    payload: Payload | None


def mounted(motions: Sequence[ObservedMotion]) -> tuple[Payload, ...]:
    """Return the payload of each mounting, in the order of their first motions."""
    return tuple({id(motion.payload): motion.payload for motion in motions if motion.payload is not None}.values())


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """One or more motions of one arm, bare and loaded in any order, from which gains are identified."""

    structure: Structure
    motions: tuple[ObservedMotion, ...]
    options: GainOptions

    def check_difference(self) -> None:
        """Raise `NotIdentifiable` if no motion is bare, or none is loaded."""
        bare = [motion.payload is None for motion in self.motions]
        if all(bare):
            raise NotIdentifiable("no motion carries a payload; without one the gains are known up to a common factor")
        if not any(bare):
            raise NotIdentifiable("no motion is bare; record one without payload")

    @property
    def payloads(self) -> tuple[Payload, ...]:
        """The payload of each mounting, in the order of their first motions."""
        return mounted(self.motions)

    @property
    def row_period(self) -> float:
        """Time from one row to the next [s]."""
        return self.motions[0].observation.joints[0].row_period


def pair(unloaded: Observation, loaded: Observation, payload: Payload, options: GainOptions) -> Problem:
    """Return the problem of one bare and one loaded motion."""
    return Problem(loaded.structure, (ObservedMotion(unloaded, None), ObservedMotion(loaded, payload)), options)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stacked:
    """Rows of motions, in order of joints (eq. 16), then of motions."""

    joint: Indices  # joint of each row, from 0, shape (r,)
    motion: Indices  # motion of each row, in the order given, shape (r,)
    position: Indices  # number of each row in its motion, including omitted rows, shape (r,)
    t: Array  # time at the middle of each row's filter [s], shape (r,)
    V: Array  # currents [drive units], shape (r,)
    weight: Array  # remaining filter weight of each row, below 1 near reversals, shape (r,)
    loaded: Mask  # mask of the rows with a payload, shape (r,)

    def since_middle(self, log: int | None = None) -> Array:
        """Time of each row from -0.5 to 0.5, from beginning to end of a log, or of the longest, shape (r,)."""
        own = self.position if log is None else self.position[self.motion == log]
        return self.position / max(1, int(own.max(initial=1))) - 0.5

    def of_logs(self, parts: Sequence[Array]) -> Array:
        """Join the rows of each motion, as `Sweep.rows` gives them, to these, shape (r, m)."""
        out = np.empty((len(self.V), *parts[0].shape[1:]))
        for number, part in enumerate(parts):
            out[self.motion == number] = part
        return out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns(Stacked):
    """`g V = W @ chi + sum of W_L @ chi_L`."""

    names: tuple[str, ...]  # names of the arm's base parameters, b strings
    W: Array  # columns of the base parameters, shape (r, b)
    W_L: Array  # ten columns of each mounting, zero in the rows of other motions, shape (mountings, r, 10)

    @classmethod
    def of(cls, motions: Sequence[ObservedMotion], joints: Sequence[int] | None = None) -> "Columns":
        """Stack motions of one structure, one or more, for some joints in ascending order, or for all."""
        structure, payloads = motions[0].observation.structure, mounted(motions)
        chosen = range(structure.arm.n) if joints is None else joints
        parts = [(j, k, motion.observation.joints[j]) for j in chosen for k, motion in enumerate(motions)]
        ends = np.cumsum([0, *(len(part.V) for *_, part in parts)]).tolist()
        r, b = ends[-1], len(structure.base.columns)
        joint, motion, position = np.empty((3, r), np.intp)
        t, V, weight = np.empty((3, r))
        W, W_L = np.zeros((r, b)), np.zeros((len(payloads), r, len(INERTIAL)))
        for (j, k, part), start, stop in zip(parts, ends, ends[1:], strict=False):
            rows = slice(start, stop)
            joint[rows], motion[rows], position[rows] = j, k, part.position
            t[rows], V[rows], weight[rows] = part.t, part.V, part.weight
            W[rows, part.columns] = part.W
            for which, payload in enumerate(payloads):
                if motions[k].payload is payload:
                    W_L[which, rows] = part.W_L
        loaded = np.array([each.payload is not None for each in motions])[motion]
        return cls(
            names=structure.base.names, joint=joint, motion=motion, position=position, t=t, V=V, weight=weight,
            loaded=loaded, W=W, W_L=W_L,
        )  # fmt: skip

    @property
    def stacked(self) -> Stacked:
        """The rows without W and W_L."""
        return Stacked(**{each.name: getattr(self, each.name) for each in fields(Stacked)})

    @property
    def carried(self) -> Array:
        """Ten columns of the payload that each row carries, zero without one, shape (r, 10)."""
        return np.sum(self.W_L, axis=0)

    def of_parameter(self, *kinds: str) -> Mask:
        """Mask of the base parameters of some kinds, as `Fv`, without regard to the joint, shape (b,)."""
        return np.isin([name.rstrip("0123456789") for name in self.names], kinds)

    def own(self, name: str) -> Array:
        """Column of `Fv`, `Fc` or `off` of each row's joint, shape (r,); zero where a shared parameter replaces it."""
        return np.sum(self.W[:, self.of_parameter(name)], axis=1)

    def friction(self, *, per_motion: bool) -> tuple[tuple[tuple[str, int], ...], Array]:
        """Name and motion, -1 for all motions, of the columns of friction and offset, and the columns, shape (r, b)."""
        motions = np.unique(self.motion).tolist() if per_motion else [-1]
        names = [(name, which) for name in OWN for which in (motions if name != "off" else [-1])]
        own = {name: self.own(name) for name in OWN}
        columns = [np.where((self.motion == which) | (which < 0), own[name], 0.0) for name, which in names]
        return tuple(names), np.column_stack(columns)


def joint_rows(problem: Problem, joint: int) -> Columns:
    """Return the rows of one joint, from 0, with the base parameters that are identifiable from this joint alone."""
    rows, alone = Columns.of(problem.motions, [joint]), problem.structure.joint_independent[joint]
    return replace(rows, names=tuple(rows.names[k] for k in alone), W=rows.W[:, alone])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SharedParameters:
    """The parameters that joints share."""

    arm: Indices  # indices of the arm's shared parameters among its base parameters, shape (a,)
    free: tuple[Indices, ...]  # independent unknown parameters of each mounting, index arrays into `INERTIAL`
    parts: tuple[KnownPayload, ...]  # known part of each mounting's payload, with factors of its covariance
    known: Array  # values of each mounting's known parameters, zero for the others, shape (mountings, 10)

    @classmethod
    def of(cls, problem: Problem) -> "SharedParameters":
        """Of a problem."""
        probes = np.vstack(list(problem.structure.payload_probes))
        known = [payload.known_part() for payload in problem.payloads]
        return cls(
            arm=np.flatnonzero(~np.isin([name.rstrip("0123456789") for name in problem.structure.base.names], OWN)),
            free=tuple(np.sort(independent_columns(probes, [np.flatnonzero(~each.mask)])) for each in known),
            parts=tuple(known),
            known=np.array([np.where(each.mask, each.chi, 0.0) for each in known]).reshape(len(known), len(INERTIAL)),
        )

    def columns(self, rows: Columns) -> tuple[Array, Array]:
        """Their columns A, shape (r, p), and the torque k of the known payload parameters [N m], shape (r,)."""
        free = [W_L[:, each] for W_L, each in zip(rows.W_L, self.free, strict=True)]
        return np.hstack([rows.W[:, self.arm], *free]), np.einsum("krp,kp->r", rows.W_L, self.known)

    def payload_values(self, theta: Array) -> Array:
        """All parameters of each mounting, known and estimated, shape (mountings, 10)."""
        chi, first = self.known.copy(), len(self.arm)
        for each, free in zip(chi, self.free, strict=True):
            each[free] = theta[first : first + len(free)]
            first += len(free)
        return chi
