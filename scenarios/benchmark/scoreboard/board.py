"""Runs of every method on every recipe whose files exist: gains, agreement, predictions, refusals.

A method receives a problem folder, as in `rx90 compare`: recordings, payloads, kinematics, but not published gains.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_options import GainOptions
from ident.estimation.known_gains import KnownGains, stated_gains
from ident.model.arm import load_arm
from ident.model.structure import Structure, structure_of
from ident.observation.observation import ObserveOptions
from ident.payload.files import read_payload
from ident.payload_identification.common_scale import negative_mass
from ident.payload_identification.gains_outcome import arm_in_use, with_unknown_weight
from ident.payload_identification.payload_estimate import payload_of
from ident.payload_identification.verification import verified
from ident.preparation import KNOWN, Prepared, prepare
from ident.recordings.motion import Motion, read
from ident.support.errors import IdentificationError, NegativeMass
from ident.unseen import predicted, unseen_motion, used_model
from scenarios.benchmark.methods.answers import AnswerRow, answered
from scenarios.benchmark.methods.call import Limits
from scenarios.benchmark.methods.method import Method
from scenarios.benchmark.scoreboard.recipes import Recipe, SetTable
from scenarios.benchmark.scoreboard.results import (
    Agreement,
    BoardGain,
    BoardPrediction,
    BoardRatio,
    BoardWeight,
    Entry,
    Refusals,
    Scoreboard,
)
from scenarios.benchmark.scoreboard.sensors import disagreements, sensor_gains
from scenarios.gains_in_use.bare import bare_answer
from scenarios.results.problem_folder import write_problem_of
from scenarios.support.errors import ScenarioError
from scenarios.support.progress import SILENT, Progress

OBSERVING, GAINS = ObserveOptions(), GainOptions()
ANSWERS, PROBLEMS, PUBLISHED = "answers.json", "problems", "published"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ready:
    """A set of recordings.

    Attributes:
        table: Its entry in the recipe.
        motions: Its recordings, bare ones first.
        rows: Answers of the methods.
    """

    table: SetTable
    motions: tuple[Motion, ...]
    rows: tuple[AnswerRow, ...]

    @property
    def files(self) -> tuple[str, ...]:
        """Digests of its recordings, in the order of `motions`."""
        return (*self.table.bare, *self.table.loaded)

    @property
    def weighed(self) -> bool:
        """Whether a payload was mounted."""
        return self.table.payload is not None


def scoreboard(
    folder: Path,
    recipes: Sequence[Recipe],
    methods: Sequence[Method],
    limits: Limits,
    out: Path,
    *,
    stages: Progress = SILENT,
) -> Scoreboard:
    """Run every method on the recordings of a folder.

    Args:
        folder: Folder of the user's downloads.
        recipes: The recipes.
        methods: The methods.
        limits: Limits of one call.
        out: Folder of problems and answers; existing answers to the same problem are reused.
        stages: Display of the current stage.

    Raises:
        ScenarioError: If the file of answers is not valid.
        OSError: If `out` cannot be written.
    """
    entries = [_entry(folder, each, methods, limits, out, stages) for each in recipes]
    return Scoreboard(folder=str(folder), methods=[method.text for method in methods], entries=entries)


def _entry(
    folder: Path, recipe: Recipe, methods: Sequence[Method], limits: Limits, out: Path, stages: Progress
) -> Entry:
    missing = [name for name in recipe.files if not recipe.place(name, folder).exists()]
    entry = Entry(
        name=recipe.name,
        source=recipe.source,
        licence=recipe.licence,
        status="missing" if missing or not recipe.files else "run",
        untried=recipe.untried,
        missing=missing,
        reason=None,
        get=recipe.get,
        published_by=recipe.published_by,
    )
    if entry.status == "missing":
        return entry
    try:
        if recipe.sensors is not None:
            entry.sensors = sensor_gains(folder / recipe.sensors.file, recipe.sensors)
            entry.notes += disagreements(entry.sensors)
        if recipe.set:
            _identified(entry, folder, recipe, methods, limits, out, stages)
    except (IdentificationError, ScenarioError) as error:
        entry.status, entry.reason = "unusable", str(error)
    return entry


def _identified(
    entry: Entry,
    folder: Path,
    recipe: Recipe,
    methods: Sequence[Method],
    limits: Limits,
    out: Path,
    stages: Progress,
) -> None:
    """Fill an entry with the results of its recordings."""
    assert recipe.model is not None, "checked where it was read"
    arm = load_arm(recipe.place(recipe.model, folder), tuple((i - 1, j - 1) for i, j in recipe.couplings))
    structure = structure_of(arm)
    published = None if recipe.published is None else stated_gains(arm, recipe.published)
    sets = [_asked(folder, recipe, each, methods, limits, out, stages) for each in recipe.set]
    for each in sets:
        entry.gains += _gains(each, published)
        if not each.weighed:
            _add_ratios(entry, each, structure, published)
    entry.agreements = [found for method in methods for found in _agreements(sets, method.text)]
    entry.predictions = list(_predictions(sets, structure, published))
    entry.weights = list(_weights(sets, structure, published))
    entry.refusals = [_refusals(sets, method.text) for method in methods]


def _asked(
    folder: Path,
    recipe: Recipe,
    table: SetTable,
    methods: Sequence[Method],
    limits: Limits,
    out: Path,
    stages: Progress,
) -> _Ready:
    """Write a set as a problem folder, and return the answers of the methods."""
    assert recipe.model is not None, "checked where it was read"
    said, payload = recipe.description, None if table.payload is None else read_payload(folder / table.payload)
    motions = [read(folder / name, None, said) for name in table.bare]
    motions += [read(folder / name, payload, said) for name in table.loaded]
    problem = out / PROBLEMS / "".join(c if c.isalnum() else "-" for c in f"{recipe.name} {table.name}".lower())
    model = recipe.place(recipe.model, folder)
    write_problem_of(problem, model, None, recipe.couplings, motions, observing=OBSERVING, gains=GAINS)
    rows = answered([problem], methods, limits, out / ANSWERS, stages=stages)
    names = [method.text for method in methods]
    own = [row for row in rows if row.problem == problem.name and row.method in names]
    return _Ready(table=table, motions=tuple(motions), rows=tuple(own))


def _gains(found: _Ready, published: KnownGains | None) -> Iterable[BoardGain]:
    for row in found.rows:
        for j, claim in enumerate(row.claims):
            stated = None if published is None else float(published.value[j])
            yield BoardGain(
                set=found.table.name,
                method=row.method,
                joint=j + 1,
                gain=claim.value,
                std=claim.std,
                published=stated,
                rel_difference=None if claim.value is None or stated is None else claim.value / stated - 1.0,
                reason=claim.reason,
            )


def _add_ratios(entry: Entry, found: _Ready, structure: Structure, published: KnownGains | None) -> None:
    """Add ratios of gains from bare motions with this project's model, or the reason why there are none."""
    options = AllJointsOptions()
    try:
        answer = bare_answer(
            found.motions, structure, observing=OBSERVING, gains=GAINS, options=options, known=published, payload=None
        )
    except IdentificationError as error:
        entry.notes.append(f"{found.table.name}: no ratios of gains: {error}")
        return
    ratios = answer.found.ratios
    assert ratios is not None, "asked of motions whose gains are not held"
    off = {each.joint: each.rel for each in answer.off}
    entry.ratios += [
        BoardRatio(
            set=found.table.name,
            joint=j + 1,
            reference=ratios.reference + 1,
            ratio=float(ratios.value[j]) if ratios.given[j] else None,
            rel_std=float(ratios.rel_std[j]) if ratios.given[j] else None,
            rel_difference=off.get(j),
        )
        for j in range(structure.arm.n)
    ]


def _agreements(sets: Sequence[_Ready], method: str) -> Iterable[Agreement]:
    for A, B in combinations([each for each in sets if each.weighed], 2):
        if set(A.files) & set(B.files):
            continue
        claims = [next((row.claims for row in each.rows if row.method == method), ()) for each in (A, B)]
        values = [
            (one.value, other.value, float(np.hypot(one.std, other.std)))
            for one, other in zip(*claims, strict=False)
            if one.value is not None and other.value is not None and one.std is not None and other.std is not None
        ]
        yield Agreement(
            method=method,
            sets=(A.table.name, B.table.name),
            joints=len(values),
            within=sum(abs(one - other) <= 2.0 * std for one, other, std in values),
            largest=max((abs(one / other - 1.0) for one, other, _ in values), default=None),
        )


def _predictions(
    sets: Sequence[_Ready], structure: Structure, published: KnownGains | None
) -> Iterable[BoardPrediction]:
    """Predict with every set the recordings outside it, if their payload is known well enough."""
    recordings = {name: each for one in sets for name, each in zip(one.files, one.motions, strict=True)}
    for one in sets:
        prepared: Prepared = prepare(one.motions, structure, policy=KNOWN)
        used = [(row.method, _known(row, structure)) for row in one.rows] + [(PUBLISHED, published)]
        models = [
            (name, used_model(arm_in_use(prepared.problem, gains), prepared.problem))
            for name, gains in used
            if gains is not None
        ]
        others = {name: each for name, each in recordings.items() if name not in one.files and _predictable(each)}
        for log, motion in others.items() if models else ():
            unseen = unseen_motion(
                motion, one.motions, structure, observing=prepared.observing, gains=GAINS, policy=KNOWN
            )
            for name, model in models:
                found = predicted(unseen, model)
                joints = [each.joint + 1 for each in found.joints if each.rel_error is not None]
                yield BoardPrediction(gains=name, set=one.table.name, log=log, joints=joints, rel_error=found.rel_error)


def _weights(sets: Sequence[_Ready], structure: Structure, published: KnownGains | None) -> Iterable[BoardWeight]:
    """Estimate the payload of a set with gains of sets that share no recording with it, and with published gains.

    Raises:
        NegativeMass: If all estimates are negative.
    """
    for one in (each for each in sets if each.weighed):
        prepared = prepare(one.motions, structure, policy=KNOWN)
        payload = next(motion.payload for motion in one.motions if motion.payload is not None)
        loaded = [motion for motion in prepared.problem.motions if motion.payload is not None]
        problem = with_unknown_weight(prepared.problem, loaded)
        apart = [each for each in sets if each.weighed and not set(each.files) & set(one.files)]
        used = [(row.method, each.table.name, _known(row, structure)) for each in apart for row in each.rows]
        refusals = list[NegativeMass | None]()
        for name, origin, gains in [*used, (PUBLISHED, None, published)]:
            if gains is None:
                continue
            try:
                found = verified(payload_of(problem, gains, AllJointsOptions()), payload, gains).together
            except IdentificationError:  # too few gains to identify the mass
                continue
            assert found.mass is not None, "refused otherwise"
            refusals.append(negative_mass(found.mass))
            yield BoardWeight(
                gains=name,
                gains_set=origin,
                set=one.table.name,
                mass=payload.mass,
                found=found.mass.value,
                std=found.mass.std,
            )
        if refusals and refusals[-1] is not None and None not in refusals:  # a single one may be due to wrong gains
            raise NegativeMass(f"set {one.table.name}: {refusals[-1]}")


def _predictable(motion: Motion) -> bool:
    return motion.payload is None or motion.payload.known in ("all", "com")


def _known(row: AnswerRow, structure: Structure) -> KnownGains | None:
    """Return the gains of a method as independent ones; None if there are none."""
    given = {j: claim for j, claim in enumerate(row.claims) if claim.value is not None}
    if not given:
        return None
    return KnownGains(
        names=structure.arm.joint_names,
        joints=np.array(list(given), dtype=np.intp),
        value=np.array([claim.value for claim in given.values()], dtype=np.float64),
        covariance=np.diag([(claim.std or 0.0) ** 2 for claim in given.values()]),
    )


def _refusals(sets: Sequence[_Ready], method: str) -> Refusals:
    rows = [(each.weighed, row) for each in sets for row in each.rows if row.method == method]
    claims = [(weighed, claim.value is not None) for weighed, row in rows for claim in row.claims]
    return Refusals(
        method=method,
        given=sum(given for _, given in claims),
        refused=sum(not given for _, given in claims),
        right=sum(not weighed and not given for weighed, given in claims),
        wrong=sum(not weighed and given for weighed, given in claims),
        failed=sum(row.failure is not None for _, row in rows),
        seconds=sum(row.seconds for _, row in rows),
    )
