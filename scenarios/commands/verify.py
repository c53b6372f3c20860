"""`rx90 verify`."""

import argparse

from scenarios.commands.log_arguments import add_log_arguments, log_description
from scenarios.commands.motion_files import MountedFiles, add_motion_arguments, mounted_files
from scenarios.commands.options import policy_of
from scenarios.commands.output import add_form_arguments, show
from scenarios.commands.progress import under_way
from scenarios.commands.robot_model import add_model_arguments, named_structure
from scenarios.commands.status import Status
from scenarios.commands.weighing import (
    add_gains_argument,
    add_overlay_arguments,
    observe_words,
    weigh,
)
from scenarios.errors import WrongFiles


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_model_arguments(parser)
    add_gains_argument(
        parser, needed=False, said="gains to hold against the scale; without them the motions predict each other"
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
    from ident.payload_files import read_payload
    from ident.weighing.verification import verified
    from scenarios.files.gains import read_gains
    from scenarios.reports.verify import verification_report

    mounted = [each for each in files if each.payload is not None]
    if len(mounted) != 1 or mounted[0].payload is None:
        raise WrongFiles(f"{len(mounted)} payloads are given; a verification weighs one, and needs a bare motion")
    file, payload = read_gains(options.gains), read_payload(mounted[0].payload)
    unloaded = [path for each in files if each.payload is None for path in each.recordings]
    with under_way(options, "weighing"):
        weighed, diagnosed = weigh(options, file, unloaded, mounted[0].recordings)
        found = verified(weighed, payload, file.known)
    show(verification_report(found, diagnosed), options)
    return Status.PASSED if found.passed else Status.MISSED


def _cross_validated(options: argparse.Namespace, files: tuple[MountedFiles, ...]) -> Status:
    from threadpoolctl import threadpool_limits

    from ident.cross_validation import cross_validated
    from ident.estimators.nls import AllJointsOptions
    from ident.identification import identify_motions
    from ident.observation import ObserveOptions
    from ident.options import options_from_words
    from ident.time_order import in_order_of_time
    from scenarios.commands.identify import recorded
    from scenarios.reports.verify import prediction_report

    own = options_from_words(AllJointsOptions, options.option)
    observing = options_from_words(ObserveOptions, observe_words(options))
    with under_way(options, "identifying") as stages, threadpool_limits(1):
        arm = named_structure(options)
        said = log_description(options, arm.arm.joint_names)
        motions = in_order_of_time([motion for each in files for motion in recorded(each, said)])
        identified = identify_motions(motions, arm, options=own, observing=observing, policy=policy_of(options))
        stages.begin("predicting")
        found = cross_validated(identified.estimate)
    show(prediction_report(identified, found), options)
    return Status.PASSED
