"""Checks of gains: implausible values, residuals, link masses by the gains, and bias by encoder noise.

The default standard deviation accounts for autocorrelated residuals. They are reported if they make it much larger than
that of white residuals (eq. 20): a better model then helps more than a longer motion.

With the gain g_j of a joint, its bare currents are a torque g_j V_j, of which the links of the model explain k_j times
their own torque:

    g_j V_j = k_j W_j chi_drawn + Ia ddq_j + Fv dq_j + Fc sign(dq_j) + off        W_j  (r, p)  rows of joint j

Gains, and thus every k_j, are proportional to the payload's mass. For real arms, data-sheet masses were correct within
a third; no gain depends on them.

Noise of the positions enters the regressor and biases least squares. Instruments avoid this bias (`iv`), with a simpler
model of friction: they are compared with the estimate (Hausman 1978) only where noise may matter, as its share of the
payload's torque exceeds the gain's standard deviation; by about that share a gain is biased that the payload alone
determines.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, finding, larger, two_digits
from ident.diagnosis.effects import claimed, consequence, severity_of
from ident.diagnosis.motion_quality import acceleration_of_unit_noise, position_quanta, quiet_cutoff
from ident.diagnosis.plausibility import LARGE_RESIDUAL
from ident.estimation.estimate import FRICTION_Z, GainEstimate, joint_signs
from ident.estimation.estimators.iv import instrumental_gains
from ident.estimation.intervals import Rows, classical, max_of_classical_and_jackknife
from ident.estimation.problem import ObservedMotion, Problem, joint_rows
from ident.estimation.sweep import inertia_matrices
from ident.model.parameters import COUPLING, INERTIAL, STANDARD
from ident.model.structure import RANK_TOL, Structure
from ident.numerics.least_squares import column_space
from ident.observation.full_rate import FullRate
from ident.observation.observation import ObserveOptions
from ident.support.arrays import Array
from ident.support.errors import IdentificationError
from ident.support.naming import joint_list

LINK_MASSES = "link masses"
IMPLAUSIBLE = ("negative gain", "gain outlier", "residual", LINK_MASSES)
"""Names of the checks of gains below; a warning of theirs is one of the gain itself."""
FAR = 100.0
"""Factor from the median of the other gains beyond which a unit is suspected; joints of one arm differ by up to 30."""
SURE_LOAD_Z = 10.0
"""Number of standard deviations of 1/g from zero beyond which the sign from the load is significant; every identified
gain exceeds it."""
ENCODER_NOISE = "encoder noise"
MUCH = 2.0
"""Ratio of standard deviations that is reported; with white residuals the largest of six joints reaches 1.8."""


def symptoms(estimate: GainEstimate, causes: Diagnosed) -> Diagnosed:
    """Return diagnoses of gains and residuals; if the logs have faults, only those that refuse gains.

    The residual of a joint whose gain encoder noise moves has that cause.
    """
    found = [each for each in (*gain_diagnoses(estimate), autocorrelation(estimate)) if each is not None]
    noisy = {each.joint for cause in causes.diagnoses if cause.name == ENCODER_NOISE for each in cause.effects}
    found = [each for each in found if each.name != "residual" or noisy.isdisjoint(each.joints)]
    refuses = causes.severity is Severity.WRONG
    return Diagnosed(diagnoses=tuple(each for each in found if not refuses or each.severity is Severity.WRONG))


def gain_diagnoses(estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Return the diagnoses of implausible gains: signs that contradict each other, outliers, large residuals."""
    found, signs = {j: each.value for j, each in estimate.identified.items()}, joint_signs(estimate)
    sure = (np.abs(signs.load_z) > SURE_LOAD_Z) & (np.abs(signs.friction_z) > FRICTION_Z)
    against = estimate.solution.joints[sure & (signs.load_z * signs.friction_z < 0.0)].tolist()
    for j in (each for each in against if each in found):
        yield finding(
            None, "sign of the gain", f"joint {j + 1}: payload and friction give the gain opposite signs",
            f"check the signs of q{j + 1} and v{j + 1}, the model and the payload's centre of mass",
            severity=Severity.WRONG, joints=(j,),
        )  # fmt: skip
    yield from negative(found)
    for j, gain in found.items():
        others = [abs(each) for k, each in found.items() if k != j]
        ratio = abs(gain) / float(np.median(others)) if others else 1.0
        if not 1.0 / FAR < ratio < FAR:
            sentence = f"joint {j + 1}: the gain is {ratio:.2g} times the median of the others"
            advice = f"check the unit of v{j + 1}"
            yield finding(None, "gain outlier", sentence, advice, joints=(j,), value=ratio, unit="times")
    for j in range(len(estimate.joints)):
        percent = 100.0 * (estimate.residual_share(j) or 0.0)
        if percent * max(lagged(estimate.solution.rows, j, 2), 0.0) ** 0.5 > 100.0 * LARGE_RESIDUAL:  # noise is white
            sentence = f"joint {j + 1}: {percent:.0f} % of the current is not explained by the model"
            advice = "check that the model is of this robot, with its couplings, friction and base"
            yield finding(None, "residual", sentence, advice, joints=(j,), value=percent, unit="%")


def negative(gains: Mapping[int, float]) -> Iterator[Diagnosis]:
    """Return the diagnoses of negative gains, by joint from 0."""
    for j, gain in gains.items():
        if gain < 0.0:
            sentence = f"joint {j + 1}: the gain is negative; v{j + 1} and q{j + 1} have opposite signs in every log"
            advice = f"correct for a motor mounted in reverse; else negate v{j + 1} or q{j + 1}"
            yield finding(None, "negative gain", sentence, advice, joints=(j,), value=gain, unit="N m/unit")


def autocorrelation(estimate: GainEstimate) -> Diagnosis | None:
    """Ratio of the standard deviation of a gain to that for white residuals; None without a gain."""
    solution = estimate.solution
    place = {int(j): k for k, j in enumerate(solution.joints)}
    if not estimate.identified:
        return None
    plain, aware = np.diag(classical(solution.rows, solution.influence)), estimate.covariance
    verb, advice = "is", None  # the interval accounts for it
    if estimate.options.uncertainty == "classical":  # for white residuals
        verb, advice = "would be", "the interval does not account for it; omit --uncertainty"
        aware = max_of_classical_and_jackknife(solution.rows, solution.influence)
    ratio = np.sqrt(np.divide(np.diag(aware), plain, out=np.ones(len(plain)), where=plain > 0.0))
    worst = max(estimate.identified, key=lambda j: ratio[place[j]])
    size = float(ratio[place[worst]])
    return finding(
        None, "autocorrelation",
        f"joint {worst + 1}: the residuals' autocorrelation is {lagged(solution.rows, worst, 1):z.2f} at lag 1; the "
        f"standard deviation that accounts for it {verb} {larger(size)} that of white residuals",
        advice if size > MUCH else None, joints=(worst,), value=size, unit="times",
    )  # fmt: skip


def lagged(rows: Rows, joint: int, lag: int) -> float:
    """Correlation of a joint's residual with that of a later row; of white currents it is at most 0 from lag 2."""
    at = np.flatnonzero(rows.joint == joint)
    place = rows.motion[at] * (int(rows.position.max()) + lag + 1) + rows.position[at]
    _, first, second = np.intersect1d(place + lag, place, assume_unique=True, return_indices=True)
    here, there = rows.residual[at][first], rows.residual[at][second]
    size = float(np.linalg.norm(here) * np.linalg.norm(there))
    return float(here @ there) / size if size > 0.0 else 0.0


SHOWN_SHARE = 0.7
"""Smallest share that the links of the model explain of the squared torque not explained by motor and friction; links
with other proportions than the arm's, such as placeholders, explain less."""
FACTOR = 1.4
"""Factor, or its inverse, beyond which masses are reported; with correct payloads real arms reached 1.26, simulated
ones 1.04."""
LEAST_JOINTS = 2
"""Smallest number of joints: a spring or a wrong gain biases a single one."""
OTHER_UNIT = 1000.0**0.5
"""Factor, or its inverse, from which another unit, such as grams for kilograms, is the likeliest explanation; links
modelled as water and made of steel are 8 times as heavy."""
ALIKE = 1e-6
"""Relative difference below which masses are equal, as of a placeholder."""


class LinkWeight(NamedTuple):
    """k of a joint, from 0, and the share that the links explain of the squared torque beside motor and friction."""

    joint: int
    factor: float
    share: float


def link_mass_consistency(problem: Problem, estimate: GainEstimate, links: Array) -> Diagnosis | None:
    """Check link masses by the gains against `links`, (n, 10); None for placeholders, or too few joints or logs."""
    found = link_mass_factor(problem.motions, {j: each.value for j, each in estimate.identified.items()}, links)
    if found is None or found.value is None or 1.0 / OTHER_UNIT < found.value < OTHER_UNIT:
        return found
    masses = dict.fromkeys(f"{each.payload.mass:g} kg" for each in problem.motions if each.payload is not None)
    return replace(
        found, severity=Severity.WRONG, joints=tuple(range(problem.structure.arm.n)),
        sentence=f"payload mass {' and '.join(masses)}: {found.sentence}; the unit of either is wrong",
        advice="state the payload's mass in kg; if the model's masses are placeholders, give all links the same",
    )  # fmt: skip


def judged(found: Sequence[LinkWeight]) -> Diagnosis | None:
    """Return a diagnosis of the factors of enough joints: weak if more than half exceed `FACTOR` in one direction."""
    shown = [each for each in found if each.share >= SHOWN_SHARE]
    if len(shown) < LEAST_JOINTS:
        return None
    factors = sorted(each.factor for each in shown)
    low, high = factors[(len(factors) - 1) // 2], factors[len(factors) // 2]  # both are equal for an odd number
    if low <= 0.0:
        return None
    off, median = max(low, 1.0 / high) > FACTOR, 0.5 * (low + high)
    joints = [each.joint for each in shown]
    return finding(
        None, LINK_MASSES,
        f"with these gains the arm's masses are {two_digits(median)} times those of its model (median of "
        f"{joint_list(joints)}, bare motions)",
        "check the payload's mass, and the masses of the model" if off else None,
        joints=joints, value=median, unit="times",
    )  # fmt: skip


def link_mass_factor(motions: Sequence[ObservedMotion], gains: Mapping[int, float], links: Array) -> Diagnosis | None:
    """Return the diagnosis of gains, by joint from 0, on bare motions; None if masses are placeholders."""
    mass = links[:, INERTIAL.index("M")]
    alike = bool(np.ptp(mass) <= ALIKE * float(np.abs(mass).max()))
    return None if alike else judged(link_weights(motions, gains, links))


def link_weights(motions: Sequence[ObservedMotion], gains: Mapping[int, float], links: Array) -> tuple[LinkWeight, ...]:
    """Return the factor of every joint with a gain, by joint from 0, and a load by its links, from the bare motions."""
    bare, found = [each.observation for each in motions if each.payload is None], list[LinkWeight]()
    for joint, gain in gains.items() if bare else ():
        base, rows = bare[0].structure.base, [each.joints[joint] for each in bare]
        K = base.regrouping[rows[0].columns]
        W, V = np.vstack([each.W for each in rows]), np.concatenate([each.V for each in rows])
        own = [f"{name}{joint + 1}" for name in STANDARD[len(INERTIAL) :]]
        beside = [k for k, name in enumerate(base.labels) if name in own or name.rstrip("0123456789") in COUPLING]
        Q = column_space(W @ K[:, beside])
        torque, drawn = (each - Q @ (Q.T @ each) for each in (gain * V, W @ (K @ base.standard(links))))
        size, whole = float(drawn @ drawn), float(torque @ torque)
        if size > ALIKE**2 * whole:
            factor = float(drawn @ torque) / size
            found.append(LinkWeight(joint=joint, factor=factor, share=factor**2 * size / whole))
    return tuple(found)


def encoder_noise(problem: Problem, estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Return the diagnosis of gains that encoder noise biases, according to the estimator that it does not bias.

    A gain is doubted if both differ by two deviations, or the noise of the payload's torque exceeds this torque.
    """
    share = np.max([np.zeros(problem.structure.arm.n), *map(noise_in_load, problem.motions)], axis=0)
    near = {j: gain for j, gain in estimate.identified.items() if share[j] > claimed(gain)}
    if not near:
        return
    try:
        unbiased = instrumental_gains(problem).identified
    except IdentificationError:
        return
    effects = list[Effect]()
    for j, mine in near.items():
        if (other := unbiased.get(j)) is not None:
            moved = mine.value / other.value - 1.0
            if abs(moved) > 2.0 * np.hypot(claimed(mine), claimed(other)) or share[j] > 1.0:
                effects.append(Effect(joint=j, percent=100.0 * moved, deviations=moved / claimed(mine)))
    if effects:  # less may be chance, or the other model
        cause, advice = noisy_positions(problem)
        yield Diagnosis(
            name=ENCODER_NOISE, severity=max(Severity.WEAK, severity_of(effects), key=list(Severity).index),
            sentence=f"{cause}{consequence(effects)}", cause=cause, effects=tuple(effects),
            advice=advice,
        )  # fmt: skip


def noisy_positions(problem: Problem) -> tuple[str, str]:
    """What is wrong with positions whose noise matters, in words, and the remedy."""
    behind = [each.observation.recorded for each in problem.motions if each.observation.full_rate is not None]
    lower = min(quiet_cutoff(each.recording, ObserveOptions(cutoff_hz=each.cutoff_hz)) for each in behind)
    steps = [(step, j) for each in behind for j, step in enumerate(position_quanta(each.recording)) if step]
    step, j = max(steps, default=(0.0, 0))
    noisy = f"have steps of {step:.2g} rad or m (q{j + 1}), too coarse" if step else "are too noisy"
    cause = f"the positions {noisy} for a low-pass at {behind[0].cutoff_hz:.3g} Hz"
    return cause, f"use --cutoff-hz {lower:.2g}, or --method iv, or log at a higher rate"


def noise_in_currents(problem: Problem, joint: int) -> float:
    """Variance of the currents of a joint, from 0, that a fit of this joint alone has from noise of accelerations."""
    structure, rows = problem.structure, joint_rows(problem, joint)
    alone, chi = structure.joint_independent[joint], np.zeros(structure.base.regrouping.shape[1])
    x = np.linalg.lstsq(np.hstack((rows.W, rows.carried)), rows.V, rcond=RANK_TOL)[0]
    chi[structure.base.columns[alone]] = x[: len(alone)]
    chi[structure.payload_columns] += x[len(alone) :]
    logs = [each.observation.full_rate for each in problem.motions]
    return max(float(noise_torque(structure, each, chi)[joint]) if each else 0.0 for each in logs)


def noise_in_load(motion: ObservedMotion) -> Array:
    """Share of the variance of the payload's torque on each joint that noise of the accelerations adds, shape (n,)."""
    observation = motion.observation
    structure, behind = observation.structure, observation.full_rate
    if motion.payload is None or behind is None:
        return np.zeros(structure.arm.n)
    part = motion.payload.known_part()
    known, chi = part.chi * part.mask, np.zeros(structure.base.regrouping.shape[1])
    chi[structure.payload_columns] = known
    noise = noise_torque(structure, behind, chi)
    load = np.array([np.var(each.W_L @ known) for each in observation.joints])
    return np.divide(noise, load, out=np.zeros_like(noise), where=load > 0.0)


def noise_torque(structure: Structure, behind: FullRate, chi: Array) -> Array:
    """Variance of the torques of an arm with standard parameters `chi` by noise of the accelerations, shape (n,)."""
    squared = np.mean(inertia_matrices(structure.arm, chi, behind.states.q) ** 2, axis=0)
    log = behind.recording
    unit = acceleration_of_unit_noise(len(log.t), log.period, behind.cutoff_hz)
    return squared @ (behind.noise / (2.0 * log.period) * unit**2)
