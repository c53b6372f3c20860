"""`rx90 patch`."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
import scenarios.command_line.gains as gains_arguments
from ident.support.naming import one_line
from scenarios.command_line.gains import add_gains_argument
from scenarios.command_line.logs import add_log_arguments, add_unseen_arguments, log_description, unseen_log
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.model.structure import Structure
    from ident.unseen import Unseen
    from scenarios.experiments.files.gains import GainsFile
    from scenarios.gains_in_use.model_values import BareFile

NAME = "rx90 patch"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("model", type=arguments.file, metavar="MODEL", help="URDF or MJCF file")
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more")
    add_gains_argument(parser, needed=True, said="drive gains, as identify --gains-out writes them")
    said = "gains on which the effort limits of MODEL are based, such as data-sheet gains, same format; without "
    add("--nominal", type=gains_arguments.gains_path, metavar="N", help=f"{said}it, efforts stay unchanged")
    said = "output of identify --json for bare recordings, with friction and armature; without it both stay unchanged"
    add("--arm", type=arguments.file, metavar="A", help=said)
    said = (
        "write mass, centre and inertia of the links too; --arm must come from bare recordings identified with --gains"
    )
    add("--links", action="store_true", help=said)
    within = arguments.number_from(1e-6, 1.0, "", "as a share of the value")
    said = "largest relative standard deviation of a value that is written (default %(default)s)"
    add("--max-rel-std", type=within, default=0.1, metavar="X", help=said)
    add("--out", type=arguments.file, required=True, metavar="FILE", help="patched copy to write")
    add("--ros-params", type=arguments.file, metavar="FILE", help="write torque constants as ROS 2 parameters, YAML")
    said = (
        "The copy is written only if it predicts the currents of LOG within the expected error, and not significantly "
        "worse than a copy with the gains of --nominal (without --nominal: than MODEL as it is); else status 1."
    )
    add_unseen_arguments(parser, said)
    add_log_arguments(parser)
    add_form_arguments(parser)
    arguments.add_force_argument(parser, "; write a copy that fails to predict --unseen")


def main(options: argparse.Namespace) -> Status:
    """Read, patch, write, report all changes."""
    written = [path for path in (options.out, options.ros_params) if path is not None]
    _check_files(options.model, written)
    held = [right_to_write(options, path.parent, [path.name], command=NAME) for path in written]
    from ident.estimation.known_gains import check_unit
    from ident.model.structure import structure_of
    from scenarios.experiments.files.gains import read_gains
    from scenarios.experiments.nominal_links import nominal_links
    from scenarios.experiments.robot_models import read_arm
    from scenarios.gains_in_use.model_patch import patched_model
    from scenarios.gains_in_use.model_values import joint_values, link_values, read_bare
    from scenarios.gains_in_use.results import patched
    from scenarios.reports.patch import AS_GIVEN, patch_report
    from scenarios.results.ros_parameters import ros_parameters

    structure, gains = structure_of(read_arm(options.model, (), flange=options.flange)), read_gains(options.gains)
    nominal = None if options.nominal is None else read_gains(options.nominal)
    bare = None if options.arm is None else read_bare(options.arm)
    joints = joint_values(structure, gains, nominal, bare, most=options.max_rel_std)
    if nominal is not None:
        check_unit(gains.known, nominal.known, "--nominal")
    links = None
    if options.links:
        links = link_values(bare, gains, structure.arm, nominal_links(options.model, options.flange))
    copy, changes = patched_model(options.model, joints, links)
    rival, other = options.model.read_bytes(), AS_GIVEN
    if nominal is not None:
        stated = joint_values(structure, nominal, None, bare, most=options.max_rel_std)
        rival, other = patched_model(options.model, stated, links)[0], "the gains of --nominal in it"
    with under_way(options, "predicting"):
        unseen = _unseen(options, structure, gains, nominal, (copy, rival), bare)
    contents = [copy]
    if options.ros_params is not None:
        contents.append(ros_parameters(gains, structure.arm.joint_names).encode())
    passed = unseen is None or unseen.not_worse
    for path, right, content in zip(written, held, contents, strict=True) if passed or options.force else ():
        with right.writing():
            path.write_bytes(content)
    told = patched(changes, gains, options.out, options.ros_params, unseen, written=passed or options.force)
    show(patch_report(told, other), options)
    return Status.PASSED if passed else Status.MISSED


def _unseen(
    options: argparse.Namespace,
    structure: "Structure",
    gains: "GainsFile",
    nominal: "GainsFile | None",
    models: tuple[bytes, bytes],
    bare: "BareFile | None",
) -> "Unseen | None":
    """Return the predictions of a motion by the copy and by the other model; None if no motion is given.

    Args:
        options: Options of the command.
        structure: Identifiable structure of the arm.
        gains: Gains of the copy.
        nominal: Gains of the other model, None for the same.
        models: Content of the copy and of the other model.
        bare: Friction, offsets and base parameters; with --links, cross-validation of their fit.

    Raises:
        ScenarioError: If the motion was used for the gains.
        ModelFileError: If MuJoCo cannot read the masses of either model.
    """
    log = unseen_log(options, log_description(options, structure.arm.joint_names))
    if log is None:
        return None
    from tempfile import TemporaryDirectory

    import numpy as np

    from ident.diagnosis.diagnosis import Severity
    from ident.diagnosis.link_masses import judged
    from ident.estimation.cross_validation import JointPrediction
    from ident.estimation.gain_options import GainOptions
    from ident.gain_errors import link_weights
    from ident.preparation import joined
    from ident.unseen import UsedModel, predicted, unseen_motion
    from scenarios.experiments.nominal_links import model_base, nominal_links
    from scenarios.gains_in_use.known_gains_problem import check_unseen, observe_options, options_of
    from scenarios.gains_in_use.model_values import unstated_parameters

    check_unseen(gains, [], [log.recording])
    limits = options_of(GainOptions, gains.options.gains, ())
    unseen = unseen_motion(log, [], structure, observing=observe_options(gains, ()), gains=limits)
    fits = {
        each.joint - 1: JointPrediction(
            joint=each.joint - 1, share=each.predicted_rel_error, fitted=each.fitted_rel_error, gain_change=np.zeros(0)
        )
        for each in (bare.joints if bare is not None and options.links else ())
        if each.predicted_rel_error is not None and each.fitted_rel_error is not None
    }
    used = list[UsedModel]()
    with TemporaryDirectory() as folder:
        path = Path(folder) / options.model.name
        for of, content in zip((gains, nominal), models, strict=True):
            path.write_bytes(content)
            base = model_base(path, options.flange, structure.base)
            added, covariance = np.zeros(len(base)), np.zeros((len(base),) * 2)
            if of is not None:
                motor = nominal_links(path, options.flange).motor
                added, covariance = unstated_parameters(structure, of, bare, base, motor)
            known = (of or gains).known
            used.append(UsedModel(gains=known, base=base + added, covariance=covariance, fits=fits, unstated=added))
    found = predicted(unseen, *used)
    if log.payload is not None:
        return found
    drawn = model_base(options.model, options.flange, structure.base)
    said = judged(link_weights(unseen.parts, gains.known, drawn))
    if said is None or said.severity is Severity.GOOD:
        return found
    doubt = replace(said, logs=(found.name,), advice="check the gains, and the masses of the model")
    return replace(found, found=joined(found.found, more=[doubt]))


def _check_files(model: Path, written: Sequence[Path]) -> None:
    """Check that copy and model have the same ending, and that no file is written twice or over the model."""
    from ident.model.files import check_ending

    check_ending(model)
    if written[0].suffix.lower() != model.suffix.lower():
        raise ScenarioError(
            f"--out {one_line(written[0])}: a copy of {one_line(model)} ends in {one_line(model.suffix)}"
        )
    places = [path.resolve() for path in (model, *written)]
    if len(set(places)) < len(places):
        raise ScenarioError("MODEL, --out and --ros-params: expected different files")
