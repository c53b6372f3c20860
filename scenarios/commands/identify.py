"""`rx90 identify`."""

import argparse
import time

import scenarios.commands.arguments as arguments
from ident.estimators import DEFAULT, ESTIMATORS
from ident.identification import Recorded, identify_motions
from ident.logs.description import LogDescription
from ident.observation import ObserveOptions
from ident.options import GainOptions, options_from_words
from scenarios.commands.log_arguments import add_log_arguments, log_description
from scenarios.commands.motion_files import MountedFiles, add_motion_arguments, mounted_files
from scenarios.commands.options import add_options, chosen
from scenarios.commands.output import add_form_arguments, form, show
from scenarios.commands.parser import complain
from scenarios.commands.status import Status


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; those of the options classes come with the classes' own descriptions."""
    add = parser.add_argument
    add("--model", type=arguments.file, required=True, metavar="ROBOT", help="MJCF or URDF file")
    add("--flange", metavar="BODY", help="last body of the arm, where the file has more; joints beyond are held")
    add_motion_arguments(parser)
    add_log_arguments(parser)
    add(
        "--coupling",
        type=arguments.count,
        nargs=2,
        action="append",
        default=[],
        metavar=("I", "J"),
        help="motor J turns with the sum of joints I and J, as 5 6 on Staubli wrists",
    )
    known = ", ".join(ESTIMATORS)
    add("--method", metavar="M", choices=ESTIMATORS, default=DEFAULT, help=f"estimator: {known} (default %(default)s)")
    add("--option", action="append", default=[], metavar="KEY=VALUE", help="an option of the method's own; repeatable")
    add_form_arguments(parser)
    for kind in (ObserveOptions, GainOptions):
        add_options(parser, kind)


def main(options: argparse.Namespace) -> Status:
    """Read, identify, tell."""
    from threadpoolctl import threadpool_limits

    from ident.structure import structure_of
    from ident.time_order import in_order_of_time
    from scenarios.reports.identify import estimate_report
    from scenarios.robot_models import read_arm

    files = mounted_files(options.given)
    with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS, and stall now and then
        couplings = tuple((i - 1, j - 1) for i, j in options.coupling)
        structure = structure_of(read_arm(options.model, couplings, flange=options.flange))
        said = log_description(options, structure.arm.joint_names)
        motions = in_order_of_time([motion for each in files for motion in _read(each, said)])
        started = time.perf_counter()
        found = identify_motions(
            motions,
            structure,
            method=options.method,
            options=options_from_words(ESTIMATORS[options.method].options, options.option),
            observing=chosen(ObserveOptions, options),
            gains=chosen(GainOptions, options),
        )
        identify_s = time.perf_counter() - started
    if form(options) == "json":
        for note in found.notes:
            complain(note)
    show(estimate_report(found, structure.arm, identify_s), options)
    return Status.PASSED


def _read(files: MountedFiles, said: LogDescription) -> list[Recorded]:
    """The motions of one mounting; how a foreign log was read is told at once."""
    from ident.payload_files import read_payload
    from ident.recording_files import read_log

    logs = [read_log(path, said) for path in files.recordings]
    for log in logs:
        for note in log.notes:
            complain(f"{log.recording.name}: {note}")
    payload = None if files.payload is None else read_payload(files.payload)
    return [Recorded(log.recording, payload) for log in logs]
