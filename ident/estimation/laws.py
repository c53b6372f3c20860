"""Laws of drive gains: what moves the torque per current, to first order, as columns of currents with priors.

    i_j = (1 + s_k + a_j x_j + b_j sign(i_j) + c_j cos q_j + d_j sin q_j + e_jk t) h_j (A_j theta + k_j)

    s_k        scale of all currents of log k, relative to the first: magnets weaken by .1 to .2 % per K
    a_j        size of the current, x_j = (|i_j| - m_j) / max |i_j|: iron saturates. m_j is the rms current with a
               payload, at which h_j holds
    b_j        sign of the current: amplifiers are asymmetric
    c_j, d_j   position: the torque constant has a ripple once a turn
    e_jk       time, from -0.5 to 0.5 within log k: magnets warm up

Drives of one arm are alike, so their coefficients of a law have one standard deviation. It is the root of its expected
square, given the coefficients of a fit with wide priors, for a half-normal prior of a stated scale (empirical Bayes). A
law that improves the predictions of omitted time blocks corrects the gains, and counts in their intervals by what the
data leave of it; the others are neglected.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ident.estimation.all_joints import Fit, Sensitivity, fit, improvement, z_of
from ident.estimation.intervals import larger_of
from ident.estimation.setting import Setting, Term
from ident.support.arrays import Array
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


SURE = 2.9
"""Number of standard errors by which a law must improve the prediction of omitted time blocks: by Bonferroni's
inequality for five laws, one set of logs in a hundred shows a law that is not there."""


@dataclass(frozen=True, slots=True, eq=False)
class Coefficients:
    """Estimated coefficients of a law, one of m drives or logs each.

    Attributes:
        value: Estimates, shape (m,).
        noise: Their standard errors, shape (m,).
        joints: Joint of each, from 0; -1 for all.
        logs: Log of each, from 0; 0 for all.
    """

    value: Array
    noise: Array
    joints: tuple[int, ...]
    logs: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Lawful:
    """A model with laws of the gains.

    Attributes:
        fit: Its fit.
        scaled: Torques of each log but the first, appended to the shared columns, shape (r, logs - 1).
        std: Standard deviation of their coefficients.
        terms: Its terms, with those of the laws.
        remarks: Laws that the data show, in words.
    """

    fit: Fit
    scaled: Array
    std: float
    terms: Mapping[str, Term]
    remarks: tuple[str, ...]

    @classmethod
    def none(cls, before: Fit, terms: Mapping[str, Term]) -> "Lawful":
        """A model without laws."""
        return cls(before, np.zeros((len(before.ready.columns.V), 0)), 0.0, terms, ())

    def effects(self, before: Fit) -> list[str]:
        """Describe the laws with the most significant change that they make to the gains of a fit without them."""
        if not self.remarks:
            return []
        change = np.abs(before.h / self.fit.h) - 1.0
        j = int(np.argmax(np.abs(change) / _noise(before.log_h)))
        return [
            "gains seem not to be constant, unless another error of the model looks the same: "
            f"{'; '.join(self.remarks)}; not corrected: "
            f"with gain_laws = true, the gain of joint {j + 1} changes by {100.0 * change[j]:+.2g} %"
        ]


def with_laws(ready: Setting, terms: Mapping[str, Term], before: Fit, stated: Mapping[str, float]) -> Lawful:
    """Fit the laws that the data show beside a model, the one that improves predictions most first.

    Args:
        ready: The problem, from recordings.
        terms: Terms of the model.
        before: Its fit.
        stated: Scale of the standard deviation of the coefficients of each law concerned.
    """
    none = Lawful.none(before, terms)
    torques = torques_by_log(ready, before)
    possible = [law for law in stated if law != SCALE or torques.shape[1]]
    if not possible:
        return none
    columns = {law: columns_of(law, ready, before) for law in possible if law != SCALE}

    def fitted(std: Mapping[str, float], start: Fit) -> Lawful:
        laws = {law: each for law, each in columns.items() if law in std}
        own = {f"{law} {k}": Term(each, std=std[law]) for law, of_law in laws.items() for k, each in of_law.items()}
        scaled, scale = torques[:, : None if SCALE in std else 0], std.get(SCALE, 0.0)
        wide = ready.widened(scaled, scale) if scaled.shape[1] else ready
        return Lawful(fit(wide, {**terms, **own}, start), scaled, scale, {**terms, **own}, ())

    def estimated(model: Lawful, laws: Collection[str]) -> dict[str, Coefficients]:
        scales = torques.shape[1]
        return {
            law: _of_logs(model.fit, scales) if law == SCALE else _of_joints(model.fit, law, [*columns[law]])
            for law in laws
        }

    free = fitted({law: WIDE * stated[law] for law in possible}, before)
    spread = {law: expected_spread(each, stated[law]) for law, each in estimated(free, possible).items()}
    shown, model = list[str](), none
    while left := [law for law in possible if law not in shown]:
        tried = {law: fitted({each: spread[each] for each in (*shown, law)}, model.fit) for law in left}
        gain = {law: improvement(each.fit, model.fit) for law, each in tried.items()}
        best = max(left, key=lambda law: float(gain[law].sum()))
        if z_of(gain[best]) < SURE:
            break
        shown, model = [*shown, best], tried[best]
    return replace(model, remarks=tuple(_words(estimated(model, shown))))


def columns_of(law: str, ready: Setting, before: Fit) -> dict[int, Array]:
    """Return columns of a law of each joint from the currents of an earlier fit, by number, shape (r,)."""
    rows, i = ready.columns, before.fitted_currents
    if law == SIGN:
        return {0: np.abs(i)}
    if law == TIME:
        return dict(enumerate(_within_logs(ready, i)))
    if law == POSITION:
        turns = (np.stack((np.cos(each.behind.q), np.sin(each.behind.q)), axis=2) for each in ready.sweeps)
        turn = ready.of_logs([sweep.decimated(each) for sweep, each in zip(ready.sweeps, turns, strict=True)])
        revolute = ready.problem.structure.arm.revolute.astype(bool)[rows.joint]
        share = np.where(revolute, i / np.where(rows.weight > 0.0, rows.weight, 1.0), 0.0)
        return {k: share * turn[:, k] for k in range(2)}
    column = np.zeros_like(i)
    for j in range(ready.n):
        own = rows.joint == j
        size, loaded = np.abs(i[own]), rows.loaded[own]
        rms = np.sqrt(np.mean(size[loaded if loaded.any() else slice(None)] ** 2))
        column[own] = i[own] * (size - rms) / max(float(size.max(initial=0.0)), 1e-300)
    return {0: column}


def _within_logs(ready: Setting, i: Array) -> Iterator[Array]:
    rows = ready.columns
    for log in range(len(ready.problem.motions)):
        own = rows.motion == log
        yield np.where(own, i * (rows.position / max(1, int(rows.position[own].max(initial=1))) - 0.5), 0.0)


def torques_by_log(ready: Setting, before: Fit) -> Array:
    """Return the torques of an earlier fit in each log but the first, zero in the others, shape (r, logs - 1)."""
    joint, motion = ready.columns.joint, ready.columns.motion
    friction = np.einsum("rf,rf->r", before.model.F, before.phi[joint])
    torque = (before.fitted_currents - friction) / before.h[joint]
    return torque[:, None] * (motion[:, None] == np.arange(1, len(ready.problem.motions)))


def _of_logs(free: Fit, scales: int) -> Coefficients:
    """Return the scales of the currents of all logs but the first, the last shared parameters of a fit."""
    at = np.arange(len(free.theta) - scales, len(free.theta))
    return Coefficients(free.theta[at], _noise(free.of_theta(at)), (-1,) * scales, tuple(range(1, scales + 1)))


def _of_joints(free: Fit, law: str, numbers: Collection[int]) -> Coefficients:
    """Return the coefficients of a law of all joints that a fit found."""
    which = {number: free.model.names.index((f"{law} {number}", -1)) for number in numbers}
    places = [(j, k, number) for number, k in which.items() for j in np.flatnonzero(free.model.own.used[:, k]).tolist()]
    joints, own, logs = (tuple(each) for each in zip(*places, strict=True))
    weights = np.zeros((len(places), *free.phi.shape))
    weights[np.arange(len(places)), joints, own] = 1.0
    return Coefficients(free.phi[joints, own], _noise(free.of_phi(weights)), joints, logs)


def _noise(found: Sensitivity) -> Array:
    variance = np.diag(larger_of(found.classical(), found.jackknife()))
    return np.hypot(np.sqrt(variance), np.linalg.norm(found.belief, axis=1))


def expected_spread(found: Coefficients, stated: float) -> float:
    """Return the root of the expected square of the standard deviation of coefficients between drives.

    -2 log p = sum(log v + value^2 / v) + spread^2 / stated^2, v = noise^2 + spread^2
    """
    v = found.noise[:, None] ** 2 + (stated * SPREADS) ** 2
    log = -0.5 * np.sum(np.log(v) + found.value[:, None] ** 2 / v, axis=0) - 0.5 * SPREADS**2 + np.log(SPREADS)
    weight = np.exp(log - log.max())  # of equal steps of the logarithm
    return stated * float(np.sqrt(weight @ SPREADS**2 / weight.sum()))


def _words(found: Mapping[str, Coefficients]) -> Iterator[str]:
    """Describe each law, of each log apart if it is one of logs, with its largest coefficient."""
    for law, each in found.items():
        of_logs = law in (SCALE, TIME)
        size = np.abs(each.value)
        for log in dict.fromkeys(each.logs) if of_logs else (0,):
            own = (np.array(each.logs) == log) | (not of_logs)
            worst = int(np.argmax(np.where(own, size, -1.0)))
            own &= (size > SURE * each.noise) | (np.arange(len(size)) == worst)
            joints = joint_list(sorted({j for j, shown in zip(each.joints, own, strict=True) if shown}))
            most = "at most " if own.sum() > 1 else ""
            value = f"{100.0 * each.value[worst]:+.2g} ± {100.0 * each.noise[worst]:.1g} %"
            yield f"{WORDS[law].format(joints=joints, log=log + 1)} {most}{value}"
