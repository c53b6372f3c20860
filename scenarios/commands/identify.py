"""`rx90 identify`."""

import argparse
import time

import scenarios.command_line.arguments as arguments
import scenarios.command_line.gains as gains_arguments
from ident.estimation.estimators import DEFAULT, ESTIMATORS
from ident.estimation.gain_options import GainOptions
from ident.identification import identify
from ident.observation.observation import ObserveOptions
from ident.recordings.description import LogDescription
from ident.recordings.recording import Motion
from ident.support.options import options_from_words
from scenarios.command_line.gains import add_gains_argument
from scenarios.command_line.logs import (
    MountedFiles,
    add_log_arguments,
    add_model_arguments,
    add_motion_arguments,
    add_unseen_arguments,
    log_description,
    mounted_files,
    read_unrepaired,
    robot_of,
    unseen_log,
)
from scenarios.command_line.options import add_options, chosen, policy_of
from scenarios.command_line.output import add_form_arguments, form, show, under_way
from scenarios.command_line.process import Status, complain
from scenarios.command_line.writing import add_save_argument, claimed_folder
from scenarios.commands import identify_bare


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; help of options is from the docstrings of their classes."""
    add = parser.add_argument
    add_model_arguments(parser)
    add_motion_arguments(parser)
    add_log_arguments(parser)
    known = ", ".join(ESTIMATORS)
    add("--method", metavar="M", choices=ESTIMATORS, default=DEFAULT, help=f"estimator: {known} (default %(default)s)")
    add("--option", action="append", default=[], metavar="KEY=VALUE", help="an option of the method; repeatable")
    add_gains_argument(parser, needed=False, said="for bare recordings only: known or a-priori gains")
    said = "for bare recordings with --gains only: a planned payload; predicts each gain's uncertainty"
    add("--if-loaded", type=arguments.file, metavar="P", help=said)
    said = "gains to compare with, a file or numbers such as 12,12,10: the payload is also estimated with them"
    gains_arguments.add_compared_gains(parser, said)
    said = "Predicted with the identified gains; with --compare-with, status 1 unless these predict it better."
    add_unseen_arguments(parser, said)
    add_save_argument(parser)
    gains_arguments.add_gains_out(parser)
    add_form_arguments(parser)
    for kind in (ObserveOptions, GainOptions):
        add_options(parser, kind)


def main(options: argparse.Namespace) -> Status:
    """Read, identify, report."""
    from threadpoolctl import threadpool_limits

    from ident.estimation.known_gains import check_comparable, estimated_gains
    from ident.parameters.weighing import outcome_of_other_gains
    from ident.recordings.recording import in_order_of_time
    from ident.unseen import predict_unseen
    from scenarios.experiments.robots import model_links
    from scenarios.results.gains import Result

    files = mounted_files(options.given)
    alone = identify_bare.wanted(options, loaded=any(each.payload is not None for each in files))
    held = gains_arguments.claimed(options, "rx90 identify")
    saving = claimed_folder(options, sum(len(each.recordings) for each in files), "rx90 identify --save")
    with under_way(options, "reading"), threadpool_limits(1):
        robot = robot_of(options, options.model)
        structure = robot.structure
        said = log_description(options, structure.arm.joint_names)
        motions = in_order_of_time([motion for each in files for motion in recorded(each, said)])
        log = unseen_log(options, said)
    if alone:
        with under_way(options, "identifying"), threadpool_limits(1):
            report = identify_bare.found(options, robot, motions, saving)
        show(report, options)
        return Status.PASSED
    own = options_from_words(ESTIMATORS[options.method].options, options.option)
    given = options.compare_with
    other = None if given is None else gains_arguments.known_gains(given, structure.arm)
    observing, limits = chosen(ObserveOptions, options), chosen(GainOptions, options)
    # threads of a BLAS do not speed up small matrices, and sometimes block
    with under_way(options, "identifying"), threadpool_limits(1):
        started = time.perf_counter()
        found = identify(
            structure,
            motions,
            method=options.method,
            options=own,
            observing=observing,
            gains=limits,
            policy=policy_of(options),
            links=model_links(robot.model, robot.flange),
        )
        identify_s = time.perf_counter() - started
        assert found.prepared is not None, "an identification has what it was found from"
        if other is not None:
            check_comparable(estimated_gains(found.estimate), other)
        cost = None if other is None else outcome_of_other_gains(found.prepared.problem, other, own)
        unseen = None if log is None else predict_unseen(found, log, other=other)
    if held is not None:
        from scenarios.results.gains_file import Origin, gains_file

        origin = Origin(model=robot.model, arm=structure.arm, motions=motions, options=own, observing=found.observing)
        gains_arguments.write(gains_file(found.estimate, origin), held)
    if form(options) == "json":
        for said in (*(each.sentence for each in found.found.reported), *found.notes):
            complain(said)
    result = Result.of_identification(found, identify_s, cost, unseen)
    title = f"Drive gains of {structure.arm.name} by {options.method}"
    if saving is not None:
        from scenarios.results.fit_rows import fit_of
        from scenarios.results.record import save_result

        with saving.writing():
            save_result(
                saving.folder,
                result,
                kind="identification",
                title=title,
                command=options.command_line,
                model=robot.model,
                flange=robot.flange,
                arm=robot.structure.arm,
                motions=motions,
                observing=found.observing,
                gains=limits,
                method=options.method,
                options=own,
                fit=fit_of(found.prepared, found.estimate),
            )
    show(result.report(title), options)
    return Status.PASSED if result.unseen is None or result.unseen.passed else Status.MISSED


def recorded(files: MountedFiles, said: LogDescription) -> list[Motion]:
    """Return the motions of one mounting; the interpretation of a foreign log is reported immediately."""
    from ident.payload.payload import read_payload

    recordings = read_unrepaired(files.recordings, said)
    payload = None if files.payload is None else read_payload(files.payload)
    return [Motion(recording, payload) for recording in recordings]
