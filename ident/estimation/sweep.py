"""One pass along a motion at one set of parameters: torques and their derivatives, at rows or at the full rate.

Torques are evaluated at fewer samples than the recording has; splines interpolate. A cubic spline is linear in its
values y and slopes s, so that the masked and decimated rows are

    rows_j = D M_j (H_0 y_j + H_1 s_j)

with D the decimation, M_j the mask of joint j, and H the cubic Hermite polynomials.

An elastic joint's link lags its motor, where the encoder is, by the transmitted torque times the compliance; likewise
velocity and acceleration. The rotor is not affected, if its inertia is identified separately. If an encoder reads d too
much, its joint is at q - d. A tilted base rotates gravity about an axis perpendicular to it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy import linalg, sparse

from ident.estimation.blocks import outside
from ident.estimation.problem import ObservedMotion, Problem, SharedParameters
from ident.model.arm import Arm
from ident.model.displacement import Dynamics, Kinematics, States
from ident.model.parameters import INERTIAL, STANDARD
from ident.model.regressor import drive_torques, inverse_dynamics, regressor
from ident.model.structure import PROBE_SEED, RANK_TOL, Structure
from ident.numerics.least_squares import column_space
from ident.numerics.signals import FILTER_ORDER, low_passed, power_density
from ident.numerics.splines import CubicSpline, slopes
from ident.observation.full_rate import FullRate
from ident.support.arrays import Array, Indices, Mask, Pieces

ROTOR_SHARE = 0.5
"""Assumed share of a rotor in a joint's inertia if the data do not separate them: gears match rotor and load
inertia."""
STATES = 16
"""Number of positions along a motion over which inertia is averaged."""
RESONANCE_HZ = 25.0
"""Assumed resonance of a rotor on its transmission [Hz]; measured ones of geared drives are 20 to 31 Hz."""
LEAST_ROTOR = 0.1
"""Smallest share of a rotor in a joint's inertia; a smaller estimate is an error of the fit."""
NOISE_SHARE = 1e-3
"""Largest share of encoder noise in the power of the effect of a joint's compliance on its own torque: with 2e-5 rad of
noise at 500 Hz, compliances have errors of 2 to 7 %, with three times this share of 30 %."""
AVERAGED_BLOCK = 60.0
"""Length of the segments whose spectra are averaged, in periods of the cut-off of the positions."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """A recorded motion, with what does not depend on the parameters."""

    problem: Problem  # the problem
    shared: SharedParameters  # the parameters that joints share
    number: int  # number of the motion in the problem

    @property
    def motion(self) -> ObservedMotion:
        """The motion."""
        return self.problem.motions[self.number]

    @property
    def behind(self) -> FullRate:
        """The motion at full rate."""
        return self.motion.observation.recorded

    @property
    def structure(self) -> Structure:
        """The arm's structure."""
        return self.problem.structure

    @cached_property
    def knots(self) -> Array:
        """Times at which torques are evaluated [s], shape (S,)."""
        return self.behind.t[self.behind.at]

    def at_full_rate(self, y: Array) -> Array:
        """Interpolate from the samples (S, m) to the full rate, (N, m)."""
        at, h = self.behind.at, np.diff(self.knots)
        stride, s, end = int(at[1]), slopes(self.knots, y), int(at[-2])
        H = _hermite(np.arange(stride) / stride, h[0])
        parts = np.stack((y[:-2], s[:-2], y[1:-1], s[1:-1]))  # (4, pieces, m)
        out = np.empty((int(at[-1]) + 1, y.shape[1]))
        out[:end] = np.tensordot(H, parts, 1).swapaxes(0, 1).reshape(end, -1)
        last = _hermite(np.arange(len(out) - end) / (len(out) - 1 - end), h[-1])
        out[end:] = last @ np.stack((y[-2], s[-2], y[-1], s[-1]))
        return out

    def rows(self, change: Array) -> Array:
        """Convert torques (S, n, m) to rows, masked and decimated like the currents, joint by joint, (rows, m)."""
        y, s = (np.ascontiguousarray(x.swapaxes(0, 1)) for x in (change, slopes(self.knots, change)))
        return np.vstack([K @ y[j] + L @ s[j] for j, (K, L) in enumerate(self.filters)])

    @cached_property
    def filters(self) -> list[tuple[sparse.csr_array, sparse.csr_array]]:
        """D M_j H_0 and D M_j H_1 of the rows of each joint, shape (r_j, S)."""
        behind = self.behind
        D, at, h = behind.decimator, behind.at, np.diff(self.knots)
        sample = np.arange(len(behind.q))
        piece = np.minimum(sample // int(at[1]), len(at) - 2)
        H = _hermite((sample - at[piece]) / np.diff(at)[piece], h[piece])  # (N, 4)
        lag = np.arange(len(D.kernel))
        found = list[tuple[sparse.csr_array, sparse.csr_array]]()
        for j, each in enumerate(self.motion.observation.joints):
            within = D.factor * each.position[:, None] + lag  # samples of each row, (r_j, l)
            weight = D.kernel * behind.moving[within, j]
            first = piece[within[:, 0]]
            width = int((piece[within[:, -1]] - first).max(initial=0)) + 2
            place = (np.arange(len(first)) * width)[:, None] + piece[within] - first[:, None]
            size = len(first) * width
            of_value, of_slope = (
                np.bincount(place.ravel(), (weight * H[within, k]).ravel(), size)
                + np.bincount(place.ravel() + 1, (weight * H[within, k + 2]).ravel(), size)[:size]
                for k in (0, 1)
            )
            columns = np.minimum(first[:, None] + np.arange(width), len(at) - 1).ravel()
            ends = width * np.arange(len(first) + 1)
            K = sparse.csr_array((of_value, columns, ends), shape=(len(first), len(at)))
            found.append((K, sparse.csr_array((of_slope, K.indices, K.indptr), shape=K.shape)))
        return found

    def decimated(self, x: Array) -> Array:
        """Mask and decimate signals at full rate (N, n, m) like the currents, joint by joint, (rows, m)."""
        behind = self.behind
        rows = behind.decimator.applied(behind.moving[:, :, None] * x)  # np.where takes eight times as long
        return np.vstack([rows[each.position, j] for j, each in enumerate(self.motion.observation.joints)])

    def at(self, theta: Array) -> "Torques":
        """The motion with the fitted parameters (p,), without friction and offset."""
        chi = self.arm_parameters(theta)
        for mounted, values in zip(self.problem.payloads, self.shared.payload_values(theta), strict=True):
            if self.motion.payload is mounted:
                chi[self.structure.payload_columns] += values
        return Torques(self, chi)

    def arm_parameters(self, theta: Array) -> Array:
        """Standard parameters of the arm without payload, friction and offset, from shared ones (p,)."""
        base, arm = self.structure.base, self.shared.arm
        chi = np.zeros(base.regrouping.shape[1])
        chi[base.columns[arm]] = theta[: len(arm)]
        return chi


def _hermite(x: Array, h: Array | float) -> Array:
    """Weights of value and slope at the start, then at the end, of an interval h at its share x, shape (N, 4)."""
    y = 1.0 - x
    return np.stack(((1.0 + 2.0 * x) * y**2, x * y**2 * h, x**2 * (3.0 - 2.0 * x), -(x**2) * y * h), axis=1)


@dataclass(frozen=True, eq=False)
class Torques:
    """Torques of an arm along a motion, without friction and offset."""

    sweep: Sweep  # the motion
    chi: Array  # standard parameters of the arm with its payload, shape (14 n + 3 c,); names as in `parameters.labels`

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.sweep.structure.arm

    @cached_property
    def sampled(self) -> Array:
        """Torques of rigid joints at the samples where they are evaluated [N m], shape (S, n)."""
        return np.concatenate([each.torques(self.chi) for _, each in self.sweep.motion.observation.link_motions])

    @cached_property
    def rotors(self) -> Array:
        """The parameters with all but separate rotor inertias set to zero."""
        at = separate_rotors(self.sweep.structure)
        rotors = np.zeros_like(self.chi)
        rotors[at] = self.chi[at]
        return rotors

    @cached_property
    def links(self) -> Pieces[Dynamics]:
        """Dynamics of the links, without rotors."""
        moving, chi = self.sweep.motion.observation.kinematics, self.chi - self.rotors
        return Pieces(moving.samples, lambda piece: Dynamics.of(moving[piece], chi))

    def by(self, change: Callable[[Dynamics], Array]) -> Array:
        """Change of the torques as a method of `Dynamics` gives it, shape (S, n, m)."""
        return np.concatenate([change(links) for _, links in self.links])

    def _displaced(self, *further: States) -> Array:
        """Change of the torques by each of m displacements and their derivatives, shape (S, n, m n)."""
        parts = ([links.displaced(each.of(piece)) for each in further] for piece, links in self.links)
        return np.concatenate([np.concatenate(part, axis=2) for part in parts])

    def softened(self, torque: Array | None = None) -> Array:
        """Change of the torques per unit of each joint's compliance, shape (S, n, n), torque first.

        From drive torques without friction [N m], shape (S, n); by default those of rigid joints.
        """
        links = self._of_links(self.sampled if torque is None else torque)
        motor = CubicSpline.through(self.sweep.knots, -links)
        return self._displaced(States(-links, motor(self.sweep.knots, 1), motor(self.sweep.knots, 2)))

    def _of_links(self, torque: Array) -> Array:
        """Torques (S, n) without those that turn separate rotors."""
        states = self.sweep.behind.states
        return torque - drive_torques(self.arm, self.rotors, states.dq, states.ddq)

    def slowed(self, softened: Array) -> Array:
        """Convert changes by compliance (S, n, n) to rows, low-passed below frequencies of encoder noise, (rows, n)."""
        sweep, behind = self.sweep, self.sweep.behind
        own = sweep.at_full_rate(np.ascontiguousarray(np.einsum("skk->sk", softened)))
        inertia = np.mean(inertia_matrices(self.arm, self.chi - self.rotors, behind.states.q) ** 2, axis=0)
        limits = shown_hz(behind, own, inertia)
        rows = list[Array]()
        for k, limit in enumerate(limits.tolist()):  # one after the other, as the full rate has many samples
            full = sweep.at_full_rate(np.ascontiguousarray(softened[:, :, k]))
            full = low_passed(full, behind.period, limit) if limit < behind.cutoff_hz else full
            rows.append(sweep.decimated(full[..., None]))
        return np.hstack(rows)

    def turned(self, beside: Sequence[int]) -> Array:
        """Change per share of the angle of joint j + k by which motor j also turns, k of m `beside`, (S, n, m n).

        The joint is then elsewhere by the share of the angle, and the motor carries that share of the other's torque.
        """
        states, motors, n = self.sweep.behind.states, np.arange(self.arm.n), self.arm.n
        change = self._displaced(*(States(*(-np.roll(x, -k, axis=1) for x in states)) for k in beside))
        for number, k in enumerate(beside):
            change[:, (motors + k) % n, number * n + motors] -= self._of_links(self.sampled)
        return change

    def slowed_down(self) -> Array:
        """Change per relative change of the duration of the motion [N m], shape (S, n, 1)."""
        states = self.sweep.behind.states
        links = self._displaced(States(np.zeros_like(states.q), -states.dq, -2.0 * states.ddq)).sum(axis=2)
        return (links - 2.0 * drive_torques(self.arm, self.rotors, states.dq, states.ddq))[..., None]


@lru_cache(maxsize=8)
def independent_misplacements(structure: Structure, mountings: tuple[bool, ...], kept: tuple[bool, ...]) -> Array:
    """Combinations of errors of zeros and tilt that other masses do not imitate on one joint alone.

    An error of the last joint's zero, for instance, has the same effect as a rotated last link with its payload. This
    depends on the structure of the arm alone, so it is found on random states with random masses, where what is zero is
    zero to rounding; the columns of a motion are interpolated.

    `mountings` tells payloads from the bare flange, `kept` the m errors concerned from the others of
    `Dynamics.misplaced`. Shape (n, m, m): columns beyond the number of combinations are zero.
    """
    arm, rng = structure.arm, np.random.default_rng(PROBE_SEED)
    inertial = np.isin(np.arange(structure.base.regrouping.shape[1]) % len(STANDARD), np.arange(len(INERTIAL)))
    inertial[len(STANDARD) * arm.n :] = False
    masses = np.where(inertial, rng.normal(size=len(inertial)), 0.0)
    loads = np.zeros((len(mountings), len(masses)))
    loads[:, structure.payload_columns] = np.array(mountings)[:, None] * rng.normal(size=(len(mountings), 10))
    W, moved = list[Array](), list[Array]()
    for load in loads:
        states = States(*rng.uniform(-np.pi, np.pi, (3, 20 * arm.n, arm.n)))
        W.append(regressor(arm, *states))
        moved.append(Dynamics.of(Kinematics.of(arm, states), masses + load).misplaced()[..., np.array(kept)])
    found = np.zeros((arm.n, sum(kept), sum(kept)))
    for j, own in enumerate(found):
        known = [linalg.block_diag(*(each[:, j, structure.payload_columns] for each in W))]
        known.append(np.vstack([each[:, j, structure.base.columns] for each in W]))
        Q = column_space(np.hstack(known))
        D = np.vstack([each[:, j] for each in moved])
        size = np.linalg.norm(D, axis=0)
        size[size == 0.0] = 1.0
        _, s, Vt = np.linalg.svd(outside(Q, D / size)[0], full_matrices=False)
        own[:, : np.count_nonzero(s > RANK_TOL)] = (Vt[s > RANK_TOL] / size).T
    return found


def shown_hz(behind: FullRate, own: Array, inertia: Array) -> Array:
    """Return the frequency up to which encoder noise in the effect of each joint's compliance is small [Hz], (n,).

    The effect depends on fourth derivatives of the positions. This noise is correlated with that of the accelerations
    and partly cancels it, so that without a limit compliances are estimated too small, and those of rigid joints
    significantly negative (`docs/derivations.md`). White noise of density N_l in the positions gives M_kk^2 (sum over l
    of M_kl^2 N_l) (2 pi f)^8, reduced by the low-pass of the positions; their cut-off is the largest frequency.

    `own` is the change of each joint's torque per compliance of itself, shape (N, n), `inertia` the mean squares of the
    inertia matrix of the links, shape (n, n).
    """
    length = min(len(own), round(AVERAGED_BLOCK / (behind.cutoff_hz * behind.period)))
    f, power = power_density(own, behind.period, length)
    inside = (f > 0.0) & (f <= behind.cutoff_hz)
    f, power = f[inside], power[inside]
    kept = (1.0 + (f / behind.cutoff_hz) ** (2 * FILTER_ORDER)) ** -2
    density = np.diag(inertia) * (inertia @ behind.noise)
    noise = ((2.0 * np.pi * f) ** 8 * kept)[:, None] * density
    little = np.cumsum(noise, axis=0) <= NOISE_SHARE * np.cumsum(power, axis=0)
    last = len(f) - 1 - np.argmax(little[::-1], axis=0)
    highest = np.where(little.any(axis=0), f[last], f[0])
    return np.where(little[-1], behind.cutoff_hz, highest)


def inertia_matrices(arm: Arm, chi: Array, q: Array) -> Array:
    """Return the inertia matrices at some positions of a motion (N, n) [kg m^2, kg m or kg], shape (STATES, n, n)."""
    q = q[np.linspace(0, len(q) - 1, STATES).astype(np.intp)]
    ddq = np.tile(np.vstack((np.zeros(arm.n), np.eye(arm.n))), (STATES, 1))
    states = np.repeat(q, arm.n + 1, axis=0)
    torque = inverse_dynamics(arm, chi, states, np.zeros_like(states), ddq).reshape(STATES, arm.n + 1, arm.n)
    return (torque[:, 1:] - torque[:, :1]).swapaxes(1, 2)


def rotor_inertia(sweep: Sweep, theta: Array, *, least: float = 0.0) -> Array:
    """Return each rotor inertia, joint side [kg m^2] or [kg], estimated or, if confounded, assumed, shape (n,).

    An estimate below the share `least` of its joint's inertia is an error of the fit.
    """
    structure, chi = sweep.structure, sweep.arm_parameters(theta)
    whole = np.mean(np.einsum("sjj->sj", inertia_matrices(structure.arm, chi, sweep.behind.q)), axis=0)
    found = np.maximum(chi[own_rotors(structure)], least * whole)
    return np.where(rotor_identifiable(structure), found, ROTOR_SHARE * whole)


def assumed_compliance(sweep: Sweep, theta: Array) -> Array:
    """Return compliances for an assumed resonance of the rotors [rad / (N m), m / N], (n,); zero without an inertia."""
    stiffness = rotor_inertia(sweep, theta, least=LEAST_ROTOR) * (2.0 * np.pi * RESONANCE_HZ) ** 2
    return np.divide(1.0, stiffness, out=np.zeros_like(stiffness), where=stiffness > 0.0)


def rotor_identifiable(structure: Structure) -> Mask:
    """Mask of the joints whose rotor inertia is identifiable separately from that of links, shape (n,)."""
    return np.isin(own_rotors(structure), separate_rotors(structure))


def own_rotors(structure: Structure) -> Indices:
    """Indices of the inertias of the joints' own motors among the standard parameters, shape (n,)."""
    return np.asarray(len(STANDARD) * np.arange(structure.arm.n) + STANDARD.index("Ia"), np.intp)


def separate_rotors(structure: Structure) -> Indices:
    """Indices of the rotor inertias that are not regrouped with link inertias, among the standard parameters."""
    base = structure.base
    alone = np.count_nonzero(base.regrouping, axis=1) == 1
    return base.columns[alone & np.array([name.startswith("Ia") for name in base.names])]
