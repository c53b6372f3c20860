"""Effects that an estimate lacks: a wrong value of a payload, a missing term, or a fault that only the gains reveal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ident.diagnosis.added import Added
from ident.diagnosis.alternative import Direction, two_digits
from ident.diagnosis.candidates import SHOWN, TIE, WORTH, Small, likeliest
from ident.diagnosis.comparison import gains, z_of
from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.estimate_model import Estimate, Stated, between, consequence, severity_of, stated
from ident.diagnosis.free_model import FreeModel
from ident.diagnosis.terms import CENTRE, ELASTICITY, INERTIA, KNOWN_CENTRE, MEASURE_CENTRE
from ident.estimation.estimate import GainSolution
from ident.estimation.problem import Problem
from ident.support.errors import IdentificationError

MOST = 3
"""Largest number of effects that one estimate lacks."""
ANOTHER = "the payload is not as specified: its centre of mass, its inertia or its mounting differs"


def lacks_of(
    base: Stated,
    small: Sequence[Direction],
    names: Sequence[str],
    free: FreeModel | None = None,
    reestimate: Estimate | None = None,
    *,
    stiff: GainSolution | None,
) -> Iterator[Diagnosis]:
    """Return effects that an estimate lacks, the one that explains most first.

    Args:
        base: The estimate.
        small: Competing directions.
        names: Names of the logs.
        free: Fits of each joint alone; if they predict significantly better, something is lacking. None to skip this.
        reestimate: Repeats the estimate for other problems.
        stiff: Its solution with rigid joints, as elastic joints may imitate faults; None to skip this.
    """
    of_payload = base.payload_errors
    believed = [each for each in of_payload if each.prior_std is not None]
    open_ones = [*small, *(each for each in of_payload if each.prior_std is None)]
    taken_up = list(imitated(base, stiff, believed, open_ones))
    for lack in taken_up:
        yield diagnosis_of(lack, names)
        base = base.beside(lack.best.direction)
        open_ones.remove(lack.best.direction)
    for each in believed:
        if (more := base.added(each)) is not None and z_of(more.u) > SHOWN and beyond_prior(each, more):
            yield diagnosis_of(Lack(base, Small(each, more), ()), names)
        base = base.beside(each)
    lacks = list(islice(shown_beside(base, open_ones), MOST - len(taken_up)))
    first = lacks[0] if lacks else None
    wrong = None if free is None or reestimate is None else _of_payload(base, free, reestimate, first, names)
    if wrong is not None:
        yield wrong
        return
    found = [diagnosis_of(each, names) for each in lacks]
    yield from found
    if free is not None:
        faults = (each for lack, each in zip(lacks, found, strict=True) if lack.best.direction.at_fault)
        beside_faults = any(each.severity is Severity.WRONG for each in faults)
        yield from _unexplained(lacks[-1].beside if lacks else base, free, beside_faults=beside_faults)


@dataclass(frozen=True, slots=True, eq=False)
class Lack:
    """A significant effect that a model lacks.

    Attributes:
        base: The model.
        best: The term or fault.
        rivals: Alternatives that cannot be distinguished from it.
    """

    base: Stated
    best: Small
    rivals: tuple[Small, ...]

    @property
    def beside(self) -> Stated:
        """The model with this effect."""
        return self.base.beside(self.best.direction)


def shown_beside(base: Stated, choices: Sequence[Direction]) -> Iterator[Lack]:
    """Return significant effects that a model lacks, the largest first, each with the earlier ones included."""
    choices = list(choices)
    while True:
        added = zip(choices, base.each_added(choices, WORTH), strict=True)
        small = [Small(each, more) for each, more in added if more is not None]
        shown = [each for each in small if each.within and each.z > SHOWN]
        if not shown:
            return
        best, rivals = likeliest(shown)
        yield Lack(base, best, rivals)
        base = base.beside(best.direction)
        choices.remove(best.direction)


def imitated(
    base: Stated, solution: GainSolution | None, believed: Sequence[Direction], choices: Sequence[Direction]
) -> Iterator[Lack]:
    """Return faults that selected elastic joints absorb: they predict significantly better than elasticity.

    Elasticity is both that of the estimate, needed for very elastic joints, and the first-order term.
    """
    if solution is None:
        return
    stiff = stated(base.problem, base.estimate, solution)
    for each in believed:
        stiff = stiff.beside(each)
    for lack in islice(shown_beside(stiff, choices), MOST):
        first_order = [lack.base.added(each) for each in choices if each.family == ELASTICITY]
        elastic = [gains(lack.base.by_joint, base.by_joint), *(each.u for each in first_order if each is not None)]
        if any(z_of(lack.best.u - each) < TIE for each in elastic) or not lack.best.direction.at_fault:
            return
        yield lack


def beyond_prior(direction: Direction, more: Added) -> bool:
    """Whether an estimated parameter contradicts its specified standard deviation."""
    assert direction.prior_std is not None, "asked of what is stated"
    spread = more.covariance + np.diag(np.square(direction.prior_std))
    return float(more.value @ np.linalg.solve(spread, more.value)) > SHOWN**2


def _of_payload(
    base: Stated, free: FreeModel, reestimate: Estimate, first: Lack | None, names: Sequence[str]
) -> Diagnosis | None:
    """Return the diagnosis of a payload that is not as specified, by gains from its mass alone.

    Args:
        base: The estimate.
        free: Fits of each joint alone.
        reestimate: Repeats the estimate for other problems.
        first: The best first-order effect; a payload that is rotated or far off exceeds the first order.
        names: Names of the logs.

    Returns:
        The diagnosis; None if nothing is left to explain, or something else explains it equally well.
    """
    opened = _with_masses_alone(base.problem)
    if opened is None or not _leaves(base, free):
        return None
    try:
        other = reestimate(opened)
    except IdentificationError:
        return None
    u = gains(base.by_joint, stated(opened, other).by_joint)
    of_payload = first is not None and first.best.family in (CENTRE, INERTIA)
    if z_of(u) < SHOWN or not (first is None or of_payload or z_of(u - first.best.u) > TIE):
        return None
    effects = tuple(between(base.estimate, other))
    if first is not None and of_payload and not _leaves(first.beside, free):  # its size is correct to first order
        diagnosis = diagnosis_of(first, names)
    else:
        logs = tuple(name for name, each in zip(names, opened.motions, strict=True) if each.payload is not None)
        diagnosis = Diagnosis(name="payload", sentence="", cause=ANOTHER, advice=MEASURE_CENTRE, logs=logs, z=z_of(u))
    return replace(
        diagnosis, severity=severity_of(effects), sentence=f"{diagnosis.cause}{consequence(effects)}", effects=effects
    )


def _leaves(base: Stated, free: FreeModel) -> bool:
    """Whether fits of each joint alone, with free payloads, predict the currents significantly better."""
    return z_of(gains(base.by_joint, free.fits.score)) > SHOWN


def _unexplained(base: Stated, free: FreeModel, *, beside_faults: bool) -> Iterator[Diagnosis]:
    """Return diagnoses of currents that a fit of each joint alone explains, but not the estimate.

    If the faults that were found do not explain them, every gain is refused.
    """
    if not _leaves(base, free):
        return
    times = np.sqrt(base.by_joint.variance / np.where(free.fits.sigma > 0.0, free.fits.score.variance, np.inf))
    worst = int(np.argmax(times))
    yield Diagnosis(
        name="unexplained",
        severity=Severity.WRONG if beside_faults else Severity.WEAK,
        sentence=(
            f"the residual is {two_digits(float(times[worst]))} times as large on joint {worst + 1} as in a fit of "
            "this joint alone; no known cause explains the difference"
        ),
        advice="check that the model, the payload and all logs are of one robot",
        joints=tuple(range(len(times))) if beside_faults else (worst,),
        value=float(times[worst]),
        unit="times",
    )


def _with_masses_alone(problem: Problem) -> Problem | None:
    """Return the problem with only the payloads' masses known; None if no more is known anyway."""
    if not any(each.known in KNOWN_CENTRE for each in problem.payloads):
        return None
    opened = {id(each): replace(each, known="mass") for each in problem.payloads if each.known in KNOWN_CENTRE}
    motions = (replace(each, payload=opened.get(id(each.payload), each.payload)) for each in problem.motions)
    return replace(problem, motions=tuple(motions))


def diagnosis_of(lack: Lack, names: Sequence[str]) -> Diagnosis:
    """Return the diagnosis of an effect that an estimate lacks.

    What the model lacks is no fault of a log: it refuses gains only if it changes one by more than the largest standard
    deviation of a gain that is not refused.
    """
    direction, more = lack.best.direction, lack.best.found
    effects = lack.base.effects(lack.base.stacked(direction.columns) @ more.value, lack.beside)
    severity = severity_of(effects)
    limit = 100.0 * lack.base.problem.options.max_rel_std
    beyond = any(each.spoils and abs(each.percent) > limit for each in effects)
    if severity is Severity.WRONG and not direction.at_fault and not beyond:
        severity = Severity.WEAK
    message = direction.message(more.value, names)
    return Diagnosis(
        name=direction.family,
        severity=severity,
        sentence=f"{message.words}{consequence(effects)}",
        cause=message.words,
        advice=message.advice,
        joints=direction.joints,
        logs=tuple(names[k] for k in direction.logs) if len(direction.logs) < len(names) else (),
        value=message.value,
        std=float(np.sqrt(more.covariance[0, 0])) * direction.scale if len(more.value) == 1 else None,
        unit=direction.unit if message.value is not None else None,
        z=z_of(more.u),
        effects=effects,
        rivals=tuple(each.direction.message(each.found.value, names).words for each in lack.rivals),
    )
