"""What an estimate lacks: terms of the model, values of the payload, and faults that only gains reveal.

Small alternatives compete as columns beside those of the estimate. Fits of each joint alone, with free payloads, show
whether something is lacking that none of them explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import TypeAlias

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity, finding, larger
from ident.diagnosis.effects import HeldOutEstimate, between, consequence, diagnosis_of, severity_of
from ident.diagnosis.evidence import Fits, log_density_improvement
from ident.diagnosis.gain_checks import ENCODER_NOISE, noise_in_currents, noisy_positions
from ident.diagnosis.hypothesis import Alternative, Logs
from ident.diagnosis.search import SHOWN, TIE, WORTH, FirstOrder, Significant, add_significant
from ident.diagnosis.terms import CENTRE, ELASTICITY, INERTIA, KNOWN_CENTRE, MEASURE_CENTRE
from ident.estimation.estimate import GainEstimate, GainSolution
from ident.estimation.intervals import z_of
from ident.estimation.problem import Problem
from ident.support.arrays import Array

MAINLY = 0.5
"""Share of a variance that explains it."""
MOST = 3
"""Largest number of effects that one estimate lacks."""
ANOTHER = "the payload is not as specified: its centre of mass, its inertia or its mounting differs"


def lacks_of(
    base: HeldOutEstimate, small: Sequence[Alternative], logs: Logs, *, stiff: GainSolution | None
) -> Iterator[Diagnosis]:
    """Return effects that an estimate lacks, of the competing directions `small`, the one that explains most first.

    Fits of each joint alone that predict significantly better show that something is lacking; they are not compared
    with an estimate that cannot be repeated. Elastic joints may imitate faults: `stiff` is the solution with rigid
    ones, None skips it.
    """
    believed = [each for each in base.payload_errors if each.prior_std is not None]
    open_ones = [*small, *(each for each in base.payload_errors if each.prior_std is None)]
    taken_up = list(imitated(base, stiff, believed, open_ones))
    for lack in taken_up:
        yield of_lack(lack, logs.names)
        base = base.beside(lack.best.alternative)
        open_ones.remove(lack.best.alternative)
    for each in believed:
        for found in base.each_added([each]):
            if found.z > SHOWN and beyond_prior(found):
                yield of_lack(Lack(base, found, ()), logs.names)
        base = base.beside(each)
    lacks = list(islice(shown_beside(base, open_ones), MOST - len(taken_up)))
    first = lacks[0] if lacks else None
    wrong = None if base.reestimate is None else _of_payload(base, logs, first)
    if wrong is not None:
        yield wrong
        return
    found = [of_lack(each, logs.names) for each in lacks]
    yield from found
    if base.reestimate is not None:
        faults = (each for lack, each in zip(lacks, found, strict=True) if lack.best.alternative.at_fault)
        beside_faults = any(each.severity is Severity.WRONG for each in faults)
        last = lacks[-1].model.beside(lacks[-1].best.alternative) if lacks else base
        yield from _unexplained(last, logs.fits, beside_faults=beside_faults)


Lack: TypeAlias = Significant[HeldOutEstimate, FirstOrder]
"""An effect that an estimate lacks."""


def shown_beside(base: HeldOutEstimate, choices: Sequence[Alternative]) -> Iterator[Lack]:
    """Return significant effects that a model lacks, the largest first, each with the earlier ones included."""

    def significant(base: HeldOutEstimate) -> list[FirstOrder]:
        return [each for each in base.each_added(choices, WORTH) if each.within and each.z > SHOWN]

    return add_significant(base, significant, lambda base, found: base.beside(found.alternative))


def imitated(
    base: HeldOutEstimate,
    solution: GainSolution | None,
    believed: Sequence[Alternative],
    choices: Sequence[Alternative],
) -> Iterator[Lack]:
    """Return faults that selected elastic joints absorb: they predict significantly better than elasticity."""
    if solution is None:
        return
    stiff = replace(base, other=solution)
    for each in believed:
        stiff = stiff.beside(each)
    for lack in islice(shown_beside(stiff, choices), MOST):
        first_order = lack.model.each_added([each for each in choices if each.family == ELASTICITY])
        elastic = [log_density_improvement(lack.model.by_joint, base.by_joint), *(each.u for each in first_order)]
        if any(z_of(lack.best.u - each) < TIE for each in elastic) or not lack.best.alternative.at_fault:
            return
        yield lack


def beyond_prior(found: FirstOrder) -> bool:
    """Whether an estimated parameter contradicts its specified standard deviation."""
    assert found.alternative.prior_std is not None, "asked of what is stated"
    spread = found.covariance + np.diag(np.square(found.alternative.prior_std))
    return float(found.value @ np.linalg.solve(spread, found.value)) > SHOWN**2


def _of_payload(base: HeldOutEstimate, logs: Logs, first: Lack | None) -> Diagnosis | None:
    """Return the diagnosis of a payload that is not as specified, by gains from its mass alone, None if it is as good.

    `first` is the best first-order effect; a payload that is rotated or far off exceeds the first order.
    """
    of_payload = first is not None and first.best.alternative.family in (CENTRE, INERTIA)
    if not _leaves(base, logs.fits) or not _may_be_of_payload(base, None if of_payload else first):
        return None
    found = from_mass_alone(base)
    if found is None:
        return None
    other, u = found
    if z_of(u) < SHOWN or not (first is None or of_payload or z_of(u - first.best.u) > TIE):
        return None
    loaded = (name for name, each in zip(logs.names, base.problem.motions, strict=True) if each.payload is not None)
    found = Diagnosis(name="payload", sentence="", cause=ANOTHER, advice=MEASURE_CENTRE, logs=tuple(loaded), z=z_of(u))
    if first is not None and of_payload and not _leaves(first.model.beside(first.best.alternative), logs.fits):
        found = of_lack(first, logs.names)  # its size is correct to first order
    effects = tuple(between(base.estimate, other)) or found.effects
    sentence = f"{found.cause}{consequence(effects)}"
    return replace(found, severity=severity_of(effects), sentence=sentence, effects=effects)


def from_mass_alone(base: HeldOutEstimate) -> tuple[GainEstimate, Array] | None:
    """Return the estimate from masses of payloads alone, and its improvement, shape (blocks,); None if that fails."""
    masses = {id(each): replace(each, known="mass") for each in base.problem.payloads if each.known in KNOWN_CENTRE}
    motions = (replace(each, payload=masses.get(id(each.payload), each.payload)) for each in base.problem.motions)
    opened = replace(base.problem, motions=tuple(motions))
    other = base.again(opened) if masses else None
    return other and (other, log_density_improvement(base.by_joint, HeldOutEstimate(opened, other).by_joint))


def _may_be_of_payload(base: HeldOutEstimate, other: Lack | None) -> bool:
    """Whether errors of all stated centres and inertias, to first order, predict better, also than another lack."""
    own = [each for each in base.payload_errors if each.family in (CENTRE, INERTIA)]
    if not own:
        return False
    of_joints = zip(*(each.columns for each in own), strict=True)
    columns = (np.hstack(each) if each[0] is not None else None for each in of_joints)
    together = next(iter(base.each_added([replace(own[0], columns=tuple(columns))])), None)
    if together is None or z_of(together.u) < SHOWN - 1.0:
        return False
    return other is None or float(np.sum(together.u - other.best.u)) > 0.0


def _leaves(base: HeldOutEstimate, free: Fits) -> bool:
    """Whether fits of each joint alone, with free payloads, predict the currents significantly better."""
    return z_of(log_density_improvement(base.by_joint, free.score)) > SHOWN


def _unexplained(base: HeldOutEstimate, free: Fits, *, beside_faults: bool) -> Iterator[Diagnosis]:
    """Return the diagnosis of currents that only fits of each joint alone explain; beside faults it refuses gains."""
    if not _leaves(base, free):
        return
    times = np.sqrt(base.by_joint.variance / np.where(free.sigma > 0.0, free.score.variance, np.inf))
    worst = int(np.argmax(times))
    most = float(times[worst])
    sentence = f"the residual of joint {worst + 1} is {larger(most)} in a fit of this joint alone"
    name, cause = "unexplained", "no known cause explains the difference"
    advice = "check that the model, the payload and all logs are of one robot"
    more = base.by_joint.variance[worst] - free.score.variance[worst]
    if 0.0 < MAINLY * more < noise_in_currents(base.problem, worst):
        name, (cause, advice) = ENCODER_NOISE, noisy_positions(base.problem)
    yield finding(
        None, name, f"{sentence}; {cause}", advice,
        severity=Severity.WRONG if beside_faults else Severity.WEAK,
        joints=range(len(times)) if beside_faults else (worst,), value=most, unit="times",
    )  # fmt: skip


def of_lack(lack: Lack, names: Sequence[str]) -> Diagnosis:
    """Return the diagnosis of an effect that an estimate lacks.

    What the model lacks is no fault of a log: it refuses gains only if it changes one by more than the largest standard
    deviation of a gain that is not refused.
    """
    base, best, rivals = lack
    unsure = best.alternative.at_fault and not base.estimate.identifiable.all()
    corrected = base.again(_without(base.problem, best)) if unsure else None
    currents = base.stacked(best.alternative.columns) @ best.value
    effects = base.effects(currents, base.beside(best.alternative), corrected)
    severity = severity_of(effects)
    limit = 100.0 * base.problem.options.max_rel_std
    beyond = any(each.spoils and abs(each.percent) > limit for each in effects)
    if severity is Severity.WRONG and not best.alternative.at_fault and not beyond:
        severity = Severity.WEAK
    words = [each.alternative.described(each.value, names).words for each in rivals]
    return diagnosis_of(best, words, names, effects, severity)


def _without(problem: Problem, found: FirstOrder) -> Problem:
    """Return a problem without the currents of an effect."""
    ends = np.cumsum([[len(own.V) for own in each.observation.joints] for each in problem.motions], axis=0)
    joints = [list(each.observation.joints) for each in problem.motions]
    for j, columns in enumerate(found.alternative.columns):
        if columns is not None:
            for of_motion, part in zip(joints, np.split(columns @ found.value, ends[:-1, j]), strict=True):
                of_motion[j] = replace(of_motion[j], V=of_motion[j].V - part)
    observed = (replace(each.observation, joints=tuple(own)) for each, own in zip(problem.motions, joints, strict=True))
    motions = (replace(each, observation=own) for each, own in zip(problem.motions, observed, strict=True))
    return replace(problem, motions=tuple(motions))
