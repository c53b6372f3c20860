"""Result of `rx90 patch`: changed and unchanged attributes, and how copy and other model predict a motion."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pydantic import Field

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Severity
from ident.diagnosis.link_masses import link_mass_factor
from ident.diagnosis.plausibility import LARGE_RESIDUAL
from ident.estimation.cross_validation import JointPrediction
from ident.estimation.gain_options import GainOptions
from ident.model.structure import Structure
from ident.preparation import joined
from ident.recordings.recording import Motion
from ident.unseen import Unseen, UsedModel, predicted, unseen_motion
from scenarios.experiments.gains_file import GainsFile
from scenarios.experiments.robots import model_base, nominal_links
from scenarios.gains_in_use.known_gains_problem import check_unseen, observe_options, options_of
from scenarios.gains_in_use.model_patch import Change
from scenarios.gains_in_use.model_values import BareFile, unstated_parameters
from scenarios.rendering.content import Mood, Paragraph, Part, column, sentence, table, two_sigma
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.results.unseen import TOLD, unseen_parts, unseen_verdict

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
    "Give --nominal to compare them with the data-sheet gains."
)
DRAWN = (
    "The copy has the links of MODEL, so the gains are tested against the link masses in that file. To test them "
    "against a payload, give --links and a motion with a weighed payload."
)


class Patched(ResultModel):
    """What `rx90 patch --json` prints."""

    out: str = Field(description="The written model")
    ros_params: str | None = Field(description="The written file of ROS 2 parameters, null for none")
    changes: list[Change] = Field(description="Attributes of joints, including unchanged ones")
    notes: list[str] = Field(description="Remarks on implausible gains")
    written: bool = Field(
        default=True,
        description="Whether the copy was written; a copy that does not predict better than the model needs --force",
    )
    against_nominal: bool = Field(
        default=False, description="Whether the copy is compared with one of data-sheet gains, not with the model as is"
    )
    unseen: FromOne[Unseen] | None = Field(
        default=None,
        description=(
            "Prediction of a motion that was not used in any fit by copy and other model, null if none is given"
        ),
    )

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
        if changed:
            parts.append(
                table(
                    changed,
                    column("Joint", lambda each: each.joint, words=True),
                    column("Attribute", lambda each: each.attribute, words=True),
                    column("Before", lambda each: _in_short(each.before), words=True),
                    column("After", lambda each: _in_short(each.after), words=True),
                    column("2 sigma [%]", lambda each: two_sigma(each.rel_std, ".2g")),
                    title="Changed",
                )
            )
        if left:
            parts.append(
                table(
                    left,
                    column("Joint", lambda each: each.joint, words=True),
                    column("Attribute", lambda each: each.attribute, words=True),
                    column("Stays", lambda each: _in_short(each.before), words=True),
                    column("Why", lambda each: each.reason, words=True),
                    title="Unchanged",
                )
            )
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
    contents: Sequence[tuple[bytes, GainsFile | None]],
    *,
    gains: GainsFile,
    bare: BareFile | None,
    links: bool,
    model: Path,
    flange: str | None,
) -> Unseen:
    """Return the predictions of a motion by the copy of a model and by another one.

    Args:
        log: The motion.
        structure: Identifiable structure of the arm.
        contents: The copy and the other model, each with gains that scale offsets and rotor inertia, None for a model
            without these.
        gains: Gains of the copy.
        bare: Friction, offsets and base parameters; with links, cross-validation of their fit.
        links: Whether the copy has identified links.
        model: The model file.
        flange: Last body of the arm, if the file has more bodies.

    Raises:
        ScenarioError: If the motion was used for the gains.
        ModelFileError: If MuJoCo cannot read the masses of either model.
    """
    check_unseen(gains, [], [log.recording])
    limits = options_of(GainOptions, gains.options.gains, ())
    unseen = unseen_motion(log, [], structure, observing=observe_options(gains, ()), gains=limits)
    fits = {
        each.joint - 1: JointPrediction(
            joint=each.joint - 1, share=each.predicted_rel_error, fitted=each.fitted_rel_error, gain_change=np.zeros(0)
        )
        for each in (bare.joints if bare is not None and links else ())
        if each.predicted_rel_error is not None and each.fitted_rel_error is not None
    }
    used = list[UsedModel]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / model.name
        for content, own in contents:
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
    by_joint = dict(zip(gains.known.joints.tolist(), gains.known.value.tolist(), strict=True))
    said = link_mass_factor(unseen.parts, by_joint, nominal_links(model, flange).whole)
    if said is None or said.severity is Severity.GOOD:
        return found
    doubt = replace(said, logs=(found.log,), advice="check the gains, and the masses of the model")
    return replace(found, diagnoses=joined(found.found, more=[doubt]).diagnoses)
