"""`rx90 verify`: gains against a known mass, motions against each other, or two files of gains."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from scenarios.command_line.gains import (
    add_compared_gains,
    add_gains_argument,
    add_overlay_arguments,
    gains_path,
    known_gains,
    observe_words,
    weigh,
)
from scenarios.command_line.logs import (
    MountedFiles,
    add_log_arguments,
    add_model_arguments,
    add_motion_arguments,
    add_unseen_arguments,
    log_description,
    mounted_files,
    robot_of,
    unseen_log,
)
from scenarios.command_line.options import policy_of
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.preparation import Prepared
    from ident.unseen import Unseen
    from scenarios.experiments.gains_file import GainsFile


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    said = "two files of gains to compare, as identify --gains-out writes them; without these, recordings are needed"
    parser.add_argument("files", type=gains_path, nargs="*", metavar="GAINS", help=said)
    add_model_arguments(parser, needed=False)
    add_gains_argument(
        parser, needed=False, said="gains to test with the payload's known mass; without them, cross-validation"
    )
    add_motion_arguments(parser)
    said = "data-sheet gains, a file or numbers such as 12,12,10; these also predict the motion of --unseen"
    add_compared_gains(parser, said)
    said = (
        "Predicted with the gains of --gains, or with the identified gains; with --compare-with, status 1 unless these "
        "predict it "
        "better than the gains of --compare-with."
    )
    add_unseen_arguments(parser, said)
    add_log_arguments(parser)
    add_overlay_arguments(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Estimate a known mass with the gains, or cross-validate, or compare two files; status 1 if something differs."""
    if options.files:
        return _compared(options)
    if options.model is None:
        raise ScenarioError("--model: give the robot of the recordings, or two files of gains to compare")
    if options.compare_with is not None and options.unseen is None:
        raise ScenarioError("--compare-with: no motion is given to predict with both sets of gains; add --unseen LOG")
    files = mounted_files(options.given)
    return _cross_validated(options, files) if options.gains is None else _weighed(options, files)


def _compared(options: argparse.Namespace) -> Status:
    from ident.estimation.gain_comparison import compared
    from scenarios.experiments.gains_file import check_units, read_gains
    from scenarios.gains_in_use.changed_gains import GainComparison

    if len(options.files) != 2:
        raise ScenarioError(f"{options.files[0]}: expected two files of gains, or --gains G with recordings")
    unused = {
        "--gains": options.gains,
        "--model": options.model,
        "--unloaded and --loaded": options.given,
        "--unseen": options.unseen,
        "--option": options.option,
        "--observe": options.observe,
        "--current-delay": options.current_delay,
        "--columns": options.columns,
    }
    for name, value in unused.items():
        if value:
            raise ScenarioError(f"{name}: for recordings; two files of gains are compared without them")
    A, B = map(read_gains, options.files)
    found = compared(A.known, B.known)
    check_units(A, B)
    show(GainComparison.of(found, A, B).report("Gains A against B"), options)
    return Status.MISSED if found.moved else Status.PASSED


def _weighed(options: argparse.Namespace, files: tuple[MountedFiles, ...]) -> Status:
    from ident.parameters.weighing import verified
    from ident.payload.payload import read_payload
    from scenarios.experiments.gains_file import read_gains
    from scenarios.gains_in_use.weighing import Verification

    mounted = [each for each in files if each.payload is not None]
    if len(mounted) != 1 or mounted[0].payload is None:
        raise ScenarioError(f"{len(mounted)} payloads are given; a verification needs exactly one, and a bare motion")
    file, payload = read_gains(options.gains), read_payload(mounted[0].payload)
    unloaded = [path for each in files if each.payload is None for path in each.recordings]
    with under_way(options, "weighing"):
        weighed, diagnosed, prepared = weigh(options, file, unloaded, mounted[0].recordings)
        found = verified(weighed, payload, file.known)
        found.body.check_mass()
        unseen = _unseen(options, file, prepared)
    result = Verification.of(found, diagnosed, unseen)
    show(result.report("Gains verified with the weighed mass"), options)
    return Status.PASSED if result.passed else Status.MISSED


def _unseen(options: argparse.Namespace, file: "GainsFile", prepared: "Prepared") -> "Unseen | None":
    """Return the prediction of a motion that was not used in any fit, None if none is given."""
    from ident.unseen import predict_with
    from scenarios.gains_in_use.known_gains_problem import check_unseen

    structure = prepared.problem.structure
    log = unseen_log(options, log_description(options, structure.arm.joint_names))
    if log is None:
        return None
    check_unseen(file, [], [log.recording])
    bare = tuple(motion for motion in prepared.motions if motion.payload is None)
    given = options.compare_with
    other = None if given is None else known_gains(given, structure.arm)
    return predict_with(file.known, replace(prepared, motions=bare), log, other=other)


def _cross_validated(options: argparse.Namespace, files: tuple[MountedFiles, ...]) -> Status:
    from threadpoolctl import threadpool_limits

    from ident.estimation.cross_validation import cross_validated
    from ident.estimation.estimators.nls import AllJointsOptions
    from ident.identification import identify
    from ident.observation.observation import ObserveOptions
    from ident.recordings.recording import in_order_of_time
    from ident.support.options import options_from_words
    from ident.unseen import predict_unseen
    from scenarios.commands.identify import recorded
    from scenarios.gains_in_use.cross_validation import CrossValidation

    own = options_from_words(AllJointsOptions, options.option)
    observing = options_from_words(ObserveOptions, observe_words(options))
    with under_way(options, "identifying") as stages, threadpool_limits(1):
        arm = robot_of(options, options.model).structure
        said = log_description(options, arm.arm.joint_names)
        motions = in_order_of_time([motion for each in files for motion in recorded(each, said)])
        identified = identify(arm, motions, options=own, observing=observing, policy=policy_of(options))
        stages.begin("predicting")
        found = cross_validated(identified.estimate)
        given, log = options.compare_with, unseen_log(options, said)
        other = None if given is None else known_gains(given, arm.arm)
        unseen = None if log is None else predict_unseen(identified, log, other=other)
    result = CrossValidation.of(identified, found, unseen)
    show(result.report(f"Motions predicted from each other, by {result.method}"), options)
    return Status.PASSED if unseen is None or unseen.passed else Status.MISSED
