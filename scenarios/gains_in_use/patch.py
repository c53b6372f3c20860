"""Identified values for a copy of a model file, `rx90 patch`, in SI, and how well the copy predicts a motion.

Friction, base parameters and links are from the output of `rx90 identify --json` for bare motions. Base parameter k of
the arm, in units of the reference joint's current, times the gain of that joint is in SI; friction is in units of the
joint's own current. Of rotor inertia Ia, only an `Ia` that is a base parameter by itself is written.
"""

import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnosis import Severity, two_digits, worst_first
from ident.diagnosis.gain_checks import link_mass_factor
from ident.diagnosis.plausibility import LARGE_RESIDUAL
from ident.estimation.intervals import JointPrediction
from ident.estimation.problem import GainOptions
from ident.model.arm import Arm
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.parameters.links import ModelLinks
from ident.recordings.recording import Motion
from ident.support.arrays import Array
from ident.support.errors import GainsError
from ident.unseen import Unseen, UsedModel, predicted, unseen_motion
from scenarios.experiments.robots import model_base, nominal_links
from scenarios.gains_in_use.known_gains import check_unseen, options_of
from scenarios.gains_in_use.model_patch import Change, JointValues, Known, Value
from scenarios.gains_in_use.weighing import UNSEEN
from scenarios.rendering.content import ColumnOf, Mood, Paragraph, Part, column, table
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.rendering.wording import sentence, two_sigma
from scenarios.results.bare import FAR, BareParameter, BareResult, Link
from scenarios.results.diagnoses import TOLD, unseen_parts, unseen_verdict
from scenarios.results.gains_file import GainEntry, GainsFile
from scenarios.support.errors import ScenarioError

NOT_BARE = "not what `rx90 identify --model ROBOT --unloaded A --json` prints of bare motions"
NO_NOMINAL = "no assumed gains are given (--nominal)"
NO_BARE = "no identification of bare motions is given (--arm)"
SAME = 1e-6
"""Largest difference due to rounding in a file: of frames, in metres or of unit vectors, and of gains, relative."""
NOTES = (
    "Efforts are scaled like the gains. Damping and friction are the joint's viscous and Coulomb friction [N m s/rad, "
    "N m; N s/m, N], without offsets and load-dependent friction; armature [kg m^2; kg]. Links, with --links, are the "
    "physically consistent ones nearest to the model that have the identified base parameters. Nothing else is changed."
)
COPY = (
    "Predictions use the copy as written. Offsets, and rotor inertia where the copy has none, are those of --arm; the "
    "table has their share of the currents, and three standard deviations of rotor inertia are allowed for."
)
LACKS = (
    "WARNING: the copy does not state rotor inertia and offsets of the currents, which are {} of the currents; --links "
    "writes rotor inertia."
)
AS_IT_IS = (
    "A copy with friction alone predicts better than the unchanged model, so this comparison does not test the gains. "
    "Give --nominal to compare them with the assumed gains."
)
DRAWN = (
    "The copy has the links of MODEL, so the gains are tested against the link masses in that file. To test them "
    "against a payload, give --links and a motion with a weighed payload."
)


def joint_values(
    structure: Structure, gains: GainsFile, nominal: GainsFile | None, bare: BareResult | None, *, most: float
) -> dict[str, JointValues]:
    """Return the identified values of every joint by its name, of those with a relative deviation of at most `most`.

    `nominal` are the assumed gains on which the efforts in the model are based. Raises `GainsError` if gains are
    not of this arm, `ScenarioError` if the bare motions are not.
    """
    arm = structure.arm
    for file in (gains, nominal):
        if file is not None and file.transmission:
            raise GainsError(
                "gains: of motors that several joints turn (transmission), but a model file has torques, friction and "
                "rotor inertias of joints, so nothing is written"
            )
        if file is not None:
            file.of(arm)
    if bare is not None and (found := tuple(each.name for each in bare.joints)) != arm.joint_names:
        expected = ", ".join(arm.joint_names)
        raise ScenarioError(f"bare motions of joints {', '.join(found)}; robot {arm.name} has {expected}")
    if bare is not None and bare.reference > arm.n:
        raise ScenarioError(f"reference = {bare.reference}: robot {arm.name} has {arm.n} joints")

    def product(found: BareParameter | str, gain: Known) -> Known:
        """Return a parameter in SI from its value in drive units, if it is positive and accurate."""
        if isinstance(found, str) or isinstance(gain, str):
            return found if isinstance(found, str) else str(gain)
        if found.estimate * gain.value <= 0.0:  # an estimate of 0 has no relative standard deviation
            return f"identified as {found.estimate * gain.value:.3g}, not positive"
        rel_std = float((found.std**2 / found.estimate**2 + gain.rel_std**2) ** 0.5)
        return limited(Value(found.estimate * gain.value, rel_std))

    def limited(found: Value) -> Known:
        if found.rel_std <= most:
            return found
        deviation = f"a standard deviation of {two_digits(100.0 * found.rel_std)} %, more than {100.0 * most:g} %"
        return f"identified as {found.value:.3g}, with {deviation}"

    def effort(j: int, gain: Known) -> Known:
        old = NO_NOMINAL if nominal is None else _gain(nominal.gains[j])
        if nominal is None or isinstance(gain, str):
            return NO_NOMINAL if nominal is None else gain
        if isinstance(old, str):
            return f"--nominal has no gain of joint {j + 1}"
        return limited(Value(abs(gain.value / old.value), gain.rel_std))

    def friction(j: int, name: str) -> BareParameter | str:
        """Return a parameter of the law v = Fv dq + Fc sign(dq) + off [drive units]."""
        own = {} if bare is None else {each.parameter: each for each in bare.joints[j].friction}
        curved = [each for each in own if each.startswith(("cbrt", "by-direction"))]
        if curved and name == "Fv":
            return f"viscous friction is not linear in speed ({', '.join(curved)})"
        if any(each.startswith(f"{name} in motion") for each in own):
            return "differs between motions; identify one, or --option friction_per_motion=false"
        return own.get(name, NO_BARE if bare is None else "not identified")

    def armature(j: int) -> BareParameter | str:
        name = f"Ia{j + 1}"
        if bare is not None and set(structure.base.groups().get(name, {})) != {name}:
            return "regrouped with link inertia: only their sum is identifiable"
        own = {} if bare is None else {each.parameter: each for each in bare.base_parameters}
        return own.get(name, NO_BARE if bare is None else "not identifiable from these motions")

    known = list(map(_gain, gains.gains))
    unit = NO_BARE if bare is None else known[bare.reference - 1]
    return {
        name: {
            "effort": effort(j, known[j]),
            "damping": product(friction(j, "Fv"), known[j]),
            "friction": product(friction(j, "Fc"), known[j]),
            "armature": product(armature(j), unit),
        }
        for j, name in enumerate(arm.joint_names)
    }


def _gain(entry: GainEntry) -> Known:
    """Return a gain with its sign, or why there is none."""
    if entry.estimate is None or entry.std is None:
        return f"the gain of joint {entry.joint} is refused"
    return Value(entry.estimate, abs(entry.std / entry.estimate))


def unstated_parameters(
    structure: Structure, gains: GainsFile, bare: BareResult | None, stated: Array, motor: Array
) -> tuple[Array, Array]:
    """Return what bare motions show and a model does not state: offsets, and rotor inertia where it is zero.

    `gains`, with which both are in SI, belong to the friction and base parameters of `bare`. The model states base
    parameters, shape (b,), and the rotor inertia of each `motor`, joint side [kg m^2 or kg], shape (n,). Returned are
    base parameters, shape (b,), and their covariance from the deviations of rotor inertia.
    """
    base, found, covariance = structure.base, np.zeros(len(stated)), np.zeros((len(stated),) * 2)
    if bare is None:
        return found, covariance
    unit, known = _gain(gains.gains[bare.reference - 1]), {each.parameter: each for each in bare.base_parameters}
    for j, joint in enumerate(bare.joints):
        gain, inertia = _gain(gains.gains[j]), base.regrouping[:, base.labels.index(f"Ia{j + 1}")]
        own = next((each for each in joint.friction if each.parameter == "off"), None)
        if own is not None and isinstance(gain, Value):
            found += own.estimate * gain.value * base.regrouping[:, base.labels.index(f"off{j + 1}")]
        k = int(np.argmax(np.abs(inertia)))  # the base parameter that it is, or is regrouped with
        if motor[j] == 0.0 and isinstance(unit, Value) and base.names[k] in known:
            shown = known[base.names[k]]
            found += max((shown.estimate * unit.value - stated[k]) / inertia[k], 0.0) * inertia
            covariance += np.outer(inertia, inertia) * (shown.std * unit.value / inertia[k]) ** 2
    return found, covariance


def link_values(bare: BareResult | None, gains: GainsFile, arm: Arm, nominal: ModelLinks) -> tuple[Link, ...]:
    """Return links whose centre of mass is in the frame of the body in the model file; `nominal` are those of the file.

    Raises `ScenarioError` if there are none, or they are of other gains or another model, or contradict the data.
    """
    if bare is None:
        raise ScenarioError("--links: no identification of bare motions is given; add --arm A")
    found = bare.consistent
    if found is None:
        why = f"--arm has no physically consistent set: {bare.consistent_reason}"
        raise ScenarioError(f"--links: {why}; identify bare motions with --gains")
    if (names := tuple(each.name for each in found.links)) != arm.joint_names:
        raise ScenarioError(f"--links: --arm is of joints {', '.join(names)}, not of those of MODEL")
    for each in found.links:
        if not each.has_frame_of(arm, nominal.carried, tolerance=SAME):
            raise ScenarioError(
                f"--links: MODEL has another frame for joint {each.name}, or other bodies fixed to its link, than the "
                "model that bare motions were identified with; identify them with this file"
            )
    if found.farthest_deviations > FAR:
        differs = f"differs by {found.farthest_deviations:.2g} standard deviations from its estimate (limit {FAR:g})"
        raise ScenarioError(
            f"--links: base parameter {found.farthest_parameter} of physically consistent links {differs}; check "
            "model, gains and data"
        )
    for joint, entry in zip(bare.joints, gains.gains, strict=True):  # masses are proportional to gains
        if joint.gain is not None and entry.estimate is not None and abs(joint.gain / entry.estimate - 1.0) > SAME:
            raise ScenarioError(
                f"--links: --arm was identified with a gain of {joint.gain:.4g} on joint {joint.joint}, but --gains "
                f"has {entry.estimate:.4g}; identify the bare motions with these gains"
            )
    places = [(np.array(each.com) + nominal.offset[each.joint - 1]).tolist() for each in found.links]
    return tuple(each.model_copy(update={"com": com}) for each, com in zip(found.links, places, strict=True))


class Patched(ResultModel):
    """What `rx90 patch --json` prints."""

    out: str  # the written model
    ros_params: str | None  # the written file of ROS 2 parameters, null for none
    changes: list[Change]  # attributes of joints, including unchanged ones
    notes: list[str]  # remarks on implausible gains
    written: bool = True  # whether the copy was written; one that does not predict better than the model needs --force
    against_nominal: bool = False  # whether the copy is compared with one of assumed gains, not with the model as is
    unseen: FromOne[Unseen] | None = Field(None, description=UNSEEN)

    def parts(self) -> list[Part]:
        """Return the verdict on the prediction, changed and unchanged attributes, prediction errors, remarks."""
        changed = [each for each in self.changes if each.after is not None]
        left = [each for each in self.changes if each.after is None]
        unseen, passed = self.unseen, None if self.unseen is None else self.unseen.not_worse
        other = "the gains of --nominal in it" if self.against_nominal else "the model as it is"
        parts = unseen_verdict(unseen, this="the copy", other=other, passed=passed)
        unstated = {each.joint + 1: each.unstated_rel or 0.0 for each in (() if unseen is None else unseen.joints)}
        if lacks := [f"{two_digits(100.0 * x)} % (joint {j})" for j, x in unstated.items() if x > LARGE_RESIDUAL]:
            parts.append(Paragraph(LACKS.format(", ".join(lacks)), Mood.DOUBTFUL, strong=True))
        done = "" if self.written else " NOT WRITTEN: it does not pass; --force writes it."
        words = f"{self.out}: {len(changed)} attributes changed, {len(left)} unchanged.{done}"
        parts.append(Paragraph(words, Mood.BAD if done else Mood.PLAIN if changed else Mood.DOUBTFUL, strong=True))
        for title, rows in (("Changed", changed), ("Unchanged", left)):
            columns: list[ColumnOf[Change]] = [
                column("Joint", lambda each: each.joint, words=True),
                column("Attribute", lambda each: each.attribute, words=True),
                column("Before" if rows is changed else "Stays", lambda each: _in_short(each.before), words=True),
                column("After", lambda each: _in_short(each.after), words=True),
                column("2 sigma [%]", lambda each: two_sigma(each.rel_std, ".2g")),
                column("Why", lambda each: each.reason, words=True),
            ]
            shown = columns[:-1] if rows is changed else [*columns[:3], columns[-1]]
            parts += [table(rows, *shown, title=title)] if rows else []
        told = [COPY, *([] if unseen is None or unseen.fitted else [DRAWN]), TOLD]
        parts += unseen_parts(unseen, other="rival", told=told + ([] if self.against_nominal else [AS_IT_IS]))
        parts += [Paragraph(NOTES), *(Paragraph(sentence(f"Note: {note}")) for note in self.notes)]
        if self.ros_params is not None and self.written:
            parts.append(Paragraph(f"{self.ros_params}: torque constants as ROS 2 parameters."))
        return parts


def _in_short(value: str | None) -> str | None:
    """Return the numbers of an attribute in six digits; file and JSON have all."""
    return re.sub(r"-?\d+\.\d{6,}(e-?\d+)?", lambda found: f"{float(found[0]):.6g}", value) if value else None


def predicted_by_models(
    log: Motion,
    structure: Structure,
    copy: tuple[bytes, GainsFile],
    rival: tuple[bytes, GainsFile | None],
    *,
    bare: BareResult | None,
    links: bool,
    model: Path,
    flange: str | None,
) -> Unseen:
    """Return the predictions of a motion by the `copy` of a model with its gains, and by a rival.

    The rival's gains are None if it is the model as it is, without offsets and rotor inertia of `bare`, whose
    cross-validation counts if the copy has identified `links`. Raises `ScenarioError` if the motion was used for the
    gains, `PlantError` if MuJoCo cannot read the masses of either model.
    """
    _, gains = copy
    check_unseen(gains, [], [log.recording])
    observing, limits = options_of(ObserveOptions, gains.options.observe), options_of(GainOptions, gains.options.gains)
    unseen = unseen_motion(log, [], structure, observing=observing, gains=limits)
    fits = {
        each.joint - 1: JointPrediction(each.joint - 1, each.predicted_rel_error, each.fitted_rel_error)
        for each in (bare.joints if bare is not None and links else ())
        if each.predicted_rel_error is not None and each.fitted_rel_error is not None
    }
    used = list[UsedModel]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / model.name
        for content, own in (copy, rival):
            path.write_bytes(content)
            base = model_base(path, flange, structure.base)
            added, covariance = np.zeros(len(base)), np.zeros((len(base),) * 2)
            if own is not None:
                added, covariance = unstated_parameters(structure, own, bare, base, nominal_links(path, flange).motor)
            known = (own or gains).known
            used.append(UsedModel(gains=known, base=base + added, covariance=covariance, fits=fits, unstated=added))
    found = predicted(unseen, *used)
    if log.payload is not None:
        return found
    said = link_mass_factor(unseen.parts, gains.known.by_joint, nominal_links(model, flange).whole)
    if said is None or said.severity is Severity.GOOD:
        return found
    doubt = replace(said, logs=(found.log,), advice="check the gains, and the masses of the model")
    return replace(found, diagnoses=worst_first([*found.diagnoses, doubt]))
