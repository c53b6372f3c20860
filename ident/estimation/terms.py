"""What may act on a joint besides viscous and Coulomb friction: laws of the speed, of the load, and compliance.

Columns of load-dependent friction and of compliance follow from the torques of an earlier fit.

A link that is deflected by the share x = (f / f0)^2 of its motion transmits 1 / (1 - x) times the torque of a rigid
joint; columns from the torques of rigid joints give 1 + x. Currents contain the exact torque, but also noise, and
friction at reversals whose timing the filters blur. Such columns are therefore replaced by their regression on all
columns from positions (two-stage least squares), which current noise does not affect.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ident.estimation.all_joints import Fit
from ident.estimation.blocks import flat, outside
from ident.estimation.problem import Stacked
from ident.estimation.setting import Setting, Term
from ident.estimation.sweep import ROTOR_SHARE, Sweep, Torques, rotor_identifiable, rotor_inertia
from ident.numerics.signals import delayed, low_passed
from ident.support.arrays import Array, Indices

STRONGEST = 0.5
"""Largest share of friction in the motor torque during the iteration."""
MOTOR, LINKS, THROUGH = "load-motor", "load", "load-through"
LOAD_FORMS = {
    MOTOR: "the motor torque",
    LINKS: "the torque of links and payload",
    THROUGH: "the torque of links, payload and other friction",
}
"""Torques that load-dependent friction can be proportional to: at the input of the gears, at their output, or in the
gears without their loss. The torque that accelerates the rotor does not pass through the gears."""
OFFSET, ROTOR = "offset-share", "rotor-share"
"""Columns of two shares that load-dependent friction depends on: the part of a joint's offset that is not a torque,
unlike that of a spring, and the part of a joint's inertia that is the rotor's, if the data do not separate the two."""
LOAD_MEAN, LOAD_STD = 0.05, 0.1
"""Initial prior of load-dependent friction: published drives lose 6 to 15 % of their torque.

If friction dominates, the gain and the load-dependent friction of a joint are confounded; without a prior the
coefficient, the gain and the torques of its column would diverge.
"""
SHARES = {OFFSET: (0.5, 0.5), ROTOR: (0.0, 0.5)}
"""Prior means and standard deviations of their coefficients: a share is between 0 and 1, and nothing else is known. The
column of load-dependent friction includes all of the offset, and half of the inertia as the rotor's."""
SPEED_TERMS = {
    "cbrt": "viscous friction grows less than linearly with speed",
    "by-direction": "viscous friction differs between directions",
}
"""Friction laws of the speed besides viscous and Coulomb friction."""
LAWS: Mapping[str, Callable[[Array], Array]] = {
    "Fv": np.positive, "Fc": np.sign, "off": np.ones_like, "cbrt": np.cbrt, "by-direction": np.abs,
}  # fmt: skip


def speed_terms(ready: Setting, laws: Collection[str]) -> dict[str, Term]:
    """Return the friction terms of all joints that depend on the speed alone, by name, without priors."""
    if not laws:
        return {}
    along = (np.stack([LAWS[name](sweep.behind.dq) for name in laws], axis=2) for sweep in ready.sweeps)
    rows = ready.columns.of_logs([sweep.decimated(each) for sweep, each in zip(ready.sweeps, along, strict=True)])
    return {name: Term(rows[:, k]) for k, name in enumerate(laws)}


def torques_of(ready: Setting, theta: Array) -> tuple[Torques, ...]:
    """Return the torques of the fitted arm along each motion."""
    return tuple(sweep.at(theta) for sweep in ready.sweeps)


def load_terms(
    ready: Setting, fit: Fit, along: Sequence[Torques], forms: Collection[str]
) -> dict[str, dict[str, Array]]:
    """Return the column of each form of load-dependent friction, then those of its `SHARES`, of all joints, (r,) each.

    They follow from an earlier fit and its torques. Coefficients have no unit, and are positive where friction brakes.
    """
    if not forms:
        return {}
    h, unseen, off = fit.h, ~rotor_identifiable(ready.problem.structure), fit.common("off", 0.0)
    spun, c = h * rotor_inertia(ready.sweeps[0], fit.theta), np.clip(fit.common(MOTOR, 0.0), -STRONGEST, STRONGEST)
    possible = {MOTOR: (OFFSET,), LINKS: (ROTOR,), THROUGH: (OFFSET, ROTOR)}
    shares = {form: [share for share in possible[form] if share == OFFSET or unseen.any()] for form in forms}
    parts = list[Array]()
    for sweep, torques in zip(ready.sweeps, along, strict=True):
        rotor, links = spun * sweep.behind.ddq, h * sweep.at_full_rate(torques.sampled)
        less = {OFFSET: off, ROTOR: np.where(unseen, 1.0 / ROTOR_SHARE, 0.0) * rotor}
        against = np.sign(h) * np.sign(sweep.behind.dq)  # the current of a negative gain has the opposite sign
        lost = list[Array]()
        for form in forms:
            x = links if form == LINKS else links + braking(sweep.behind.dq, fit, sweep.number)
            x = x if form == MOTOR else x - rotor
            for each in (x, *(x - less[share] for share in shares[form])):
                size = np.abs(each) * against
                # torque of the motor includes this friction: W = x + c |W| s has |W| s = (|x| s + c x) / (1 - c^2)
                lost.append((size + c * each) / (1.0 - c**2) if form == MOTOR else size)
        parts.append(sweep.decimated(np.stack(lost, axis=2)))
    columns, found = iter(ready.columns.of_logs(parts).T), dict[str, dict[str, Array]]()
    for form in forms:
        load, scale = next(columns), fit.common(form, LOAD_MEAN)[ready.columns.joint]
        found[form] = {form: load, **{share: scale * (next(columns) - load) for share in shares[form]}}
    return found


def braking(dq: Array, fit: Fit, motion: int) -> Array:
    """Return the current of speed-dependent friction and offset at some speeds in a motion, shape (N, n)."""
    total = np.zeros_like(dq)
    for k, (name, which) in enumerate(fit.model.names):
        if name in LAWS and which in (-1, motion):
            total += fit.phi[:, k] * LAWS[name](dq)
    return total


def compliance_columns(rows: Stacked, along: Sequence[Torques]) -> Array:
    """Return the change of torque of all joints' rows per compliance of each, from torques of rigid joints, (r, n)."""
    return rows.of_logs([each.slowed(each.softened()) for each in along])


def with_softened(ready: Setting, along: Sequence[Torques]) -> Setting:
    """Return the same problem with its columns of compliance, from these torques if it has none."""
    return ready if ready.softened.size else replace(ready, softened=compliance_columns(ready.columns, along))


def columns_along(
    ready: Setting, fitted: Fit, forms: Collection[str], elastic: Indices, speeds: Mapping[str, Term]
) -> tuple[Setting, dict[str, dict[str, Array]]]:
    """Return the problem with the compliances of elastic joints, and `load_terms`, from the torques of an earlier fit.

    `speeds` are the friction terms of the speed that joints have.
    """
    along = torques_of(ready, fitted.theta)
    loads = load_terms(ready, fitted, along, forms)
    if not len(elastic):
        return ready, loads
    beside = [*(term.column for term in speeds.values()), *(columns[form] for form, columns in loads.items())]
    exact = transmitted_columns(with_softened(ready, along), fitted, along, beside)
    return ready.widened(exact[:, elastic]), loads


def transmitted_columns(ready: Setting, before: Fit, along: Sequence[Torques], beside: Collection[Array]) -> Array:
    """Return the change of torque of all joints' rows per compliance of each, from the torques of the currents, (r, n).

    A fit converts currents to torques; `beside` are columns of further friction terms that joints may have, (r,) each.
    """
    parts = list[Array]()
    for sweep, torques in zip(ready.sweeps, along, strict=True):
        parts.append(sweep.rows(torques.softened(transmitted(sweep, before)[sweep.behind.at])))
    blocks, exact, more = ready.blocks, ready.columns.of_logs(parts), np.column_stack((ready.softened, *beside))
    own, exact, more = (flat(x) for x in (blocks.own.Q, blocks.layout.padded(exact), blocks.layout.padded(more)))
    others = blocks.alone.extended(outside(own, more)[0], np.linalg.norm(more, axis=1))
    return blocks.layout.rows(exact - others.outside(outside(own, exact)[0]))


def transmitted(sweep: Sweep, before: Fit) -> Array:
    """Return drive torques without friction, low-passed like the positions, at full rate [N m], shape (N, n)."""
    behind = sweep.behind
    V = delayed(behind.recording.v, behind.current_delay / behind.recording.period)
    links = without_friction(V, behind.dating, before, sweep.number) / before.h
    return behind.sampled(low_passed(links, behind.recording.period, behind.cutoff_hz))


def without_friction(V: Array, dq: Array, before: Fit, motion: int) -> Array:
    """Return currents (N, n) at some speeds in a motion without the friction of a fit.

    Gear friction is computed from the torque of links and rotor together, which neglects its error from the rotor's
    torque.
    """
    against = np.sign(before.h) * np.sign(dq)

    def carried(current: Array, form: str) -> Array:
        c = np.clip(before.common(form, 0.0), -STRONGEST, STRONGEST)
        return current / (1.0 + c * against * np.sign(current)) if c.any() else current

    share = before.common(OFFSET, 0.0)
    load = (1.0 - share) * np.abs(V) + share * np.abs(V - before.common("off", 0.0))
    V = V - before.common(MOTOR, 0.0) * load * against
    return carried(carried(V, THROUGH) - braking(dq, before, motion), LINKS)
