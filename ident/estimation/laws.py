"""Laws of drive gains: what moves the torque per current, to first order, as columns of currents with priors.

    i_j = (1 + s_k + a_j x_j + b_j sign(i_j) + c_j cos q_j + d_j sin q_j + e_jk t) h_j (A_j theta + k_j)

    s_k        scale of all currents of log k, relative to the first: magnets weaken by .1 to .2 % per K
    a_j        size of the current, x_j = (|i_j| - m_j) / max |i_j|: iron saturates. m_j is the rms current with a
               payload, at which h_j holds
    b_j        sign of the current: amplifiers are asymmetric; with a_j, the gain over the current (`GainCurve`)
    c_j, d_j   position: the torque constant has a ripple once a turn
    e_jk       time, from -0.5 to 0.5 within log k: magnets warm up

Drives of one arm are alike, so their coefficients of a law have one standard deviation. It is the root of its expected
square, given the coefficients of a fit with wide priors, for Student's prior of a stated scale (empirical Bayes). A
law that improves the predictions of omitted time blocks is named, and corrects the gains if asked to. With x and N the
coefficients of the fit with wide priors and their covariance, and D their variances between drives, the coefficients
that do not correct the gains have, given the data,

    mean m = D (N + D)^-1 x        covariance P = D - D (N + D)^-1 D

so that gains fitted without them, of which they change the logarithm by S, have the mean square error S (P + m m') S'.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ident.estimation.all_joints import Fit, fit, improvement
from ident.estimation.estimate import GainCurve
from ident.estimation.intervals import deviations, z_of
from ident.estimation.setting import Term
from ident.support.arrays import Array
from ident.support.errors import NotIdentifiable
from ident.support.naming import joint_list

SCALE, SIZE, SIGN, POSITION, TIME = "scale", "size", "sign", "position", "time"
WORDS = {
    SCALE: "currents per torque of log {log} differ from those of the first log by",
    SIZE: "the gain of {joints} falls with the size of the current, at its peak relative to zero by",
    SIGN: "the gain of {joints} depends on the sign of the current; positive currents per torque are larger by",
    POSITION: "the gain of {joints} varies with the joint's position, once a turn, by",
    TIME: "the gain of {joints} falls within log {log}, from beginning to end by",
}
"""Description of a law that the data show, followed by the largest coefficient."""
WIDE = 5.0
"""Prior standard deviation of the first fit, in stated ones."""
SPREADS = np.geomspace(0.01, 10.0, 61)
"""Standard deviations between drives, in stated ones."""
FREEDOM = 3.0
"""Degrees of freedom of Student's distribution of this standard deviation: the fewest with an expected square."""
SURE = 2.9
"""Number of standard errors by which a law must improve the prediction of omitted time blocks: by Bonferroni's
inequality for five laws, one set of logs in a hundred shows a law that is not there."""


@dataclass(frozen=True, slots=True)
class Place:
    """A coefficient of a law: its number, a log or one of `columns_of`, and its joint, from 0; -1 for all joints."""

    law: str
    number: int
    joint: int


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """Estimated coefficients of laws: m places, values, shape (m,), and their covariance, shape (m, m)."""

    places: tuple[Place, ...]
    value: Array
    covariance: Array

    @property
    def noise(self) -> Array:
        """Standard errors, shape (m,)."""
        return deviations(self.covariance)

    @property
    def may_predict(self) -> bool:
        """Whether they improve the fit by more than overfitting does: else predictions do not improve (Akaike 1974)."""
        return float(self.value @ np.linalg.solve(self.covariance, self.value)) > 2.0 * len(self.value)

    def of(self, laws: Collection[str]) -> "Coefficients":
        """Those of some laws."""
        at = np.array([k for k, each in enumerate(self.places) if each.law in laws], np.intp)
        return Coefficients(tuple(self.places[k] for k in at), self.value[at], self.covariance[np.ix_(at, at)])


@dataclass(frozen=True, slots=True, eq=False)
class Lawful:
    """A model with laws of the gains."""

    fit: Fit  # its fit
    scaled: Array  # torques of each log but the first, appended to the shared columns, shape (r, logs - 1) or (r, 0)
    std: float  # standard deviation of their coefficients
    terms: Mapping[str, Term]  # its terms, with those of the laws
    remarks: tuple[str, ...]  # laws that the data show, in words
    unsure: Array  # relative change of each gain per standard deviation of coefficients that do not correct it, (n, m)
    # gain over current of each joint, by joint from 0, if size or sign correct the gains:
    curves: Mapping[int, GainCurve] = field(default_factory=dict[int, GainCurve])


def with_laws(terms: Mapping[str, Term], before: Fit, stated: Mapping[str, float], *, corrected: bool) -> Lawful:
    """Find the laws that the data show beside a fit with some terms, the one that improves predictions most first.

    `stated` has the scale of the standard deviation of the coefficients of each law concerned. There are no laws if the
    data have too few rows for them, or a fit with them does not converge.
    """
    ready = before.ready
    none = Lawful(before, np.zeros((len(ready.columns.V), 0)), 0.0, terms, (), np.zeros((ready.n, 0)))
    columns = {law: columns_of(law, before) for law in stated}
    possible = [law for law, each in columns.items() if each]
    if not possible:
        return none

    def fitted(std: Mapping[str, float], start: Fit) -> Lawful:
        scaled, own = none.scaled, dict(terms)
        for law in std:
            if law == SCALE:
                scaled = np.column_stack([*columns[law].values()]) / before.h[ready.columns.joint][:, None]
            else:
                own |= {f"{law} {k}": Term(each, std=std[law]) for k, each in columns[law].items()}
        wide = ready.widened(scaled, std.get(SCALE, 0.0))
        return replace(none, fit=fit(wide, own, start), scaled=scaled, std=std.get(SCALE, 0.0), terms=own)

    shown, model = list[str](), none
    try:
        free = coefficients(fitted({law: WIDE * stated[law] for law in possible}, before).fit, columns)
        spread = {law: expected_spread(free.of([law]), stated[law]) for law in possible}
        likely = [law for law in possible if free.of([law]).may_predict]
        while left := [law for law in likely if law not in shown]:
            tried = {law: fitted({each: spread[each] for each in (*shown, law)}, model.fit) for law in left}
            gain = {law: improvement(each.fit, model.fit).sum(axis=0) for law, each in tried.items()}
            best = max(left, key=lambda law: float(gain[law].sum()))
            if z_of(gain[best]) < SURE:
                break
            shown, model = [*shown, best], tried[best]
    except NotIdentifiable:
        return none
    words = tuple(_words(coefficients(model.fit, {law: columns[law] for law in shown}))) if shown else ()
    if not corrected:
        if words:
            change = np.abs(before.h / model.fit.h) - 1.0
            j = int(np.argmax(np.abs(change) / before.log_h.std))
            words = (
                "gains seem not to be constant, unless another error of the model looks the same: "
                f"{'; '.join(words)}; not corrected: "
                f"with gain_laws = true, the gain of joint {j + 1} changes by {100.0 * change[j]:+.2g} %",
            )
        model, shown = none, []
    left = free.of([law for law in possible if law not in shown])
    curves = _curves(model.fit, before) if SIZE in shown or SIGN in shown else {}
    return replace(model, remarks=words, unsure=_unsure(model.fit, columns, left, spread), curves=curves)


def _curves(found: Fit, before: Fit) -> dict[int, GainCurve]:
    """Return the gain over current of each joint, from a fit with laws of columns from the currents of one before."""
    (rms, peak), n = _sizes(before), len(found.h)
    weights = np.zeros((2, n, *found.phi.shape))
    for law, of, share in zip((SIZE, SIGN), weights, (1.0 / peak, np.ones(n)), strict=True):
        if (name := (f"{law} 0", -1)) in found.model.names:
            of[np.arange(n), np.arange(n), found.model.names.index(name)] = share
    value = np.einsum("qjkf,kf->qj", weights, found.phi)
    C = found.log_h.beside(found.of_phi(weights.reshape(2 * n, *found.phi.shape))).covariance.reshape(3, n, 3, n)
    C[0], C[:, :, 0] = -C[0], -C[:, :, 0]  # of log g
    largest = np.max([np.abs(each.behind.recording.v).max(axis=0) for each in found.ready.sweeps], axis=0)
    return {
        j: GainCurve(
            current=float(rms[j]),
            largest=float(largest[j]),
            slope=float(value[0, j]),
            by_sign=float(value[1, j]),
            covariance=((a[0], a[1], a[2]), (b[0], b[1], b[2])),
        )
        for j in range(n)
        for a, b in [(C[1:, j, :, j] + 0.0).tolist()]
    }


def _unsure(
    final: Fit, columns: Mapping[str, Mapping[int, Array]], left: Coefficients, spread: Mapping[str, float]
) -> Array:
    """Return the relative change of each gain per standard deviation of neglected coefficients, shape (n, m)."""
    influence, S = final.log_h.influence, np.zeros((len(final.h), len(left.places)))
    for k, place in enumerate(left.places):
        own = (final.ready.columns.joint == place.joint) | (place.joint < 0)
        S[:, k] = influence[:, own] @ columns[place.law][place.number][own]
    D = np.diag(np.square([spread[each.law] for each in left.places]))
    K = np.linalg.solve(left.covariance + D, D).T
    m = K @ left.value
    size, along = np.linalg.eigh(D - K @ D + np.outer(m, m))
    return S @ along * np.sqrt(np.maximum(size, 0.0))


def columns_of(law: str, before: Fit) -> dict[int, Array]:
    """Return the columns (r,) of a law that are not zero, of all joints, from the currents of an earlier fit.

    Their numbers are those of logs for scale and time, else from 0.
    """
    ready, i = before.ready, before.fitted_currents
    rows, logs = ready.columns, range(len(ready.problem.motions))
    if law == SCALE:
        friction = np.einsum("rf,rf->r", before.model.F, before.phi[rows.joint])
        columns = {log: np.where(rows.motion == log, i - friction, 0.0) for log in logs[1:]}
    elif law == SIGN:
        columns = {0: np.abs(i)}
    elif law == TIME:
        columns = {log: np.where(rows.motion == log, i * rows.since_middle(log), 0.0) for log in logs}
    elif law == POSITION:
        turns = (np.stack((np.cos(each.behind.q), np.sin(each.behind.q)), axis=2) for each in ready.sweeps)
        turn = ready.columns.of_logs([sweep.decimated(each) for sweep, each in zip(ready.sweeps, turns, strict=True)])
        revolute = ready.problem.structure.arm.revolute.astype(bool)[rows.joint]
        share = np.where(revolute, i / np.where(rows.weight > 0.0, rows.weight, 1.0), 0.0)
        columns = {k: share * turn[:, k] for k in range(2)}
    else:
        rms, peak = (each[rows.joint] for each in _sizes(before))
        columns = {0: i * (np.abs(i) - rms) / peak}
    return {k: each for k, each in columns.items() if each.any()}


def _sizes(before: Fit) -> tuple[Array, Array]:
    """Return the rms with a payload, or of all rows, and the largest fitted current of each joint, shapes (n,)."""
    rows, i = before.ready.columns, np.abs(before.fitted_currents)
    own = [i[rows.joint == j] for j in range(len(before.h))]
    loaded = [i[(rows.joint == j) & rows.loaded] for j in range(len(before.h))]
    rms = [np.sqrt(np.mean((some if len(some) else each) ** 2)) for some, each in zip(loaded, own, strict=True)]
    return np.array(rms), np.array([max(float(each.max(initial=0.0)), 1e-300) for each in own])


def coefficients(found: Fit, columns: Mapping[str, Mapping[int, Array]]) -> Coefficients:
    """Return the coefficients of some laws, with columns as `columns_of`, in a fit with them."""
    logs = [*columns.get(SCALE, {})]
    at = np.arange(len(found.theta) - len(logs), len(found.theta))
    names, used = found.model.names, found.model.own.used
    own = {(law, k): names.index((f"{law} {k}", -1)) for law in columns if law != SCALE for k in columns[law]}
    of_joints = [(Place(*key, j), x) for key, x in own.items() for j in np.flatnonzero(used[:, x]).tolist()]
    places = [Place(SCALE, log, -1) for log in logs] + [each for each, _ in of_joints]
    joints, which = [each.joint for each, _ in of_joints], [x for _, x in of_joints]
    both = found.of_theta(at).beside(found.of_own(joints, which))
    value = np.concatenate((found.theta[at], found.phi[joints, which]))
    return Coefficients(tuple(places), value, both.covariance)


def expected_spread(found: Coefficients, stated: float) -> float:
    """Return the root of the expected square of the standard deviation of coefficients between drives.

    -2 log p = sum(log v + value^2 / v) + (f + 1) log(1 + (spread / stated)^2 / (f - 2)), v = noise^2 + spread^2
    """
    v = found.noise[:, None] ** 2 + (stated * SPREADS) ** 2
    prior = np.log(SPREADS) - 0.5 * (FREEDOM + 1.0) * np.log(1.0 + SPREADS**2 / (FREEDOM - 2.0))
    log = prior - 0.5 * np.sum(np.log(v) + found.value[:, None] ** 2 / v, axis=0)
    weight = np.exp(log - log.max())  # of equal steps of the logarithm
    return stated * float(np.sqrt(weight @ SPREADS**2 / weight.sum()))


def _words(found: Coefficients) -> Iterator[str]:
    """Describe each law, of each log apart if it is one of logs, with its largest coefficient."""
    for law in dict.fromkeys(each.law for each in found.places):
        of_law, of_logs = found.of([law]), law in (SCALE, TIME)
        size, noise = np.abs(of_law.value), of_law.noise
        number = np.array([each.number if of_logs else 0 for each in of_law.places])
        for log in np.unique(number).tolist():
            worst = int(np.argmax(np.where(number == log, size, -1.0)))
            own = (number == log) & ((size > SURE * noise) | (np.arange(len(size)) == worst))
            joints = joint_list(sorted({of_law.places[k].joint for k in np.flatnonzero(own)}))
            most = "at most " if own.sum() > 1 else ""
            value = f"{100.0 * of_law.value[worst]:+.2g} ± {100.0 * noise[worst]:.1g} %"
            yield f"{WORDS[law].format(joints=joints, log=log + 1)} {most}{value}"
