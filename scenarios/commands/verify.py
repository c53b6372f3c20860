"""`rx90 verify`."""

import argparse

from scenarios.command_line.known_gains_arguments import add_gains_argument, add_overlay_arguments, observe_words, weigh
from scenarios.command_line.log_arguments import add_log_arguments, log_description
from scenarios.command_line.motion_arguments import MountedFiles, add_motion_arguments, mounted_files
from scenarios.command_line.options import policy_of
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.progress import under_way
from scenarios.command_line.robot_arguments import add_model_arguments, named_structure
from scenarios.command_line.status import Status
from scenarios.support.errors import ScenarioError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_model_arguments(parser)
    add_gains_argument(
        parser, needed=False, said="gains to test against the payload's known mass; without them, cross-validation"
    )
    add_motion_arguments(parser)
    add_log_arguments(parser)
    add_overlay_arguments(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Weigh a known mass with the gains, or cross-validate; 1 if a mass differs."""
    files = mounted_files(options.given)
    return _cross_validated(options, files) if options.gains is None else _weighed(options, files)


def _weighed(options: argparse.Namespace, files: tuple[MountedFiles, ...]) -> Status:
    from ident.payload.files import read_payload
    from ident.payload_identification.verification import verified
    from scenarios.experiments.files.gains import read_gains
    from scenarios.reports.verify import verification_report

    mounted = [each for each in files if each.payload is not None]
    if len(mounted) != 1 or mounted[0].payload is None:
        raise ScenarioError(f"{len(mounted)} payloads are given; a verification needs exactly one, and a bare motion")
    file, payload = read_gains(options.gains), read_payload(mounted[0].payload)
    unloaded = [path for each in files if each.payload is None for path in each.recordings]
    with under_way(options, "weighing"):
        weighed, diagnosed = weigh(options, file, unloaded, mounted[0].recordings)
        found = verified(weighed, payload, file.known)
    show(verification_report(found, diagnosed), options)
    return Status.PASSED if found.passed else Status.MISSED


def _cross_validated(options: argparse.Namespace, files: tuple[MountedFiles, ...]) -> Status:
    from threadpoolctl import threadpool_limits

    from ident.estimation.cross_validation import cross_validated
    from ident.estimation.estimators.nls import AllJointsOptions
    from ident.identification import identify
    from ident.observation.observation import ObserveOptions
    from ident.recordings.motion import in_order_of_time
    from ident.support.options import options_from_words
    from scenarios.commands.identify import recorded
    from scenarios.reports.verify import prediction_report

    own = options_from_words(AllJointsOptions, options.option)
    observing = options_from_words(ObserveOptions, observe_words(options))
    with under_way(options, "identifying") as stages, threadpool_limits(1):
        arm = named_structure(options)
        said = log_description(options, arm.arm.joint_names)
        motions = in_order_of_time([motion for each in files for motion in recorded(each, said)])
        identified = identify(arm, motions, options=own, observing=observing, policy=policy_of(options))
        stages.begin("predicting")
        found = cross_validated(identified.estimate)
    show(prediction_report(identified, found), options)
    return Status.PASSED
