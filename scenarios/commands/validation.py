"""Commands that use gains: `rx90 verify` tests them, `payload-of`, `torque` and `patch` compute from them."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ident.support.naming import one_line
from scenarios.command_line import arguments, inputs, output
from scenarios.command_line.process import Status
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from ident.model.structure import Structure
    from ident.payload.payload import Payload
    from scenarios.gains_in_use.known_gains import Weighing
    from scenarios.results.gains_file import GainsFile

REL_STD = arguments.number_from(1e-6, 1.0, "", "as a share of the value")


def verify_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare gains files, or robot, recordings and gains."""
    text = "two files of gains to compare, as identify --gains-out writes them; without these, recordings are needed"
    parser.add_argument("files", type=arguments.gains_file, nargs="*", metavar="GAINS", help=text)
    inputs.add_model_arguments(parser, needed=False)
    inputs.add_gains_argument(parser, needed=False, text="gains to test with the payload's known mass")
    inputs.add_motion_arguments(parser)
    text = "assumed gains, a file or numbers such as 12,12,10; these also predict the motion of --unseen"
    parser.add_argument("--compare-with", type=arguments.gains_or_numbers, metavar="G", help=text)
    text = "Predicted with the gains of --gains; with --compare-with, status 1 unless these predict it better."
    inputs.add_unseen_arguments(parser, text)
    inputs.add_log_arguments(parser)
    inputs.add_delay_argument(parser)


def verify_command(options: argparse.Namespace) -> Status:
    """Estimate a known mass with the gains, or compare two files; status 1 if something differs."""
    if options.files:
        return _compared(options)
    for name, what in (("model", "the robot of the recordings"), ("gains", "the gains to test")):
        if getattr(options, name) is None:
            raise ScenarioError(f"--{name}: give {what}, or two files of gains to compare")
    if options.compare_with is not None and options.unseen is None:
        raise ScenarioError("--compare-with: no motion is given to predict with both sets of gains; add --unseen LOG")
    from ident.payload.payload import read_payload
    from ident.unseen import predict_with
    from scenarios.gains_in_use.known_gains import check_unseen
    from scenarios.gains_in_use.weighing import Verification
    from scenarios.results.gains_file import read_gains

    mounted = inputs.mountings(options.given)
    loaded = [each for each in mounted if each.payload is not None]
    if len(loaded) != 1 or loaded[0].payload is None:
        raise ScenarioError(f"{len(loaded)} payloads are given; a verification needs exactly one, and a bare motion")
    file, payload = read_gains(options.gains), read_payload(loaded[0].payload)
    unloaded = [path for each in mounted if each.payload is None for path in each.recordings]
    with output.under_way(options, "weighing"):
        structure = inputs.robot_of(options, options.model).structure
        found = _payload_of(options, structure, file, unloaded, loaded[0].recordings, payload)
        prepared, arm = found.prepared, structure.arm
        log, unseen = inputs.unseen_motion(options, inputs.log_description(options, arm.joint_names)), None
        if log is not None:
            check_unseen(file, [], [log.recording])
            bare = tuple(motion for motion in prepared.motions if motion.payload is None)
            other = None if options.compare_with is None else inputs.known_gains(options.compare_with, arm)
            unseen = predict_with(file.known, replace(prepared, motions=bare), log, other=other)
    assert found.verified is not None, "of a weighed payload"
    result = Verification.of(found.verified, found.found, unseen)
    title = f"{one_line(options.gains)} verified with the payload of {one_line(loaded[0].payload)}"
    return output.show(result.report(title), options, passed=result.passed)


def _compared(options: argparse.Namespace) -> Status:
    """Compare two files of gains."""
    from ident.estimation.gain_comparison import compared
    from scenarios.gains_in_use.gain_comparison import GainComparison
    from scenarios.results.gains_file import check_units, read_gains

    if len(options.files) != 2:
        raise ScenarioError(f"{options.files[0]}: expected two files of gains, or --gains G with recordings")
    for name in ("gains", "model", "given", "unseen", "current_delay", "columns"):
        if getattr(options, name):
            option = "--unloaded and --loaded" if name == "given" else f"--{name.replace('_', '-')}"
            raise ScenarioError(f"{option}: for recordings; two files of gains are compared without them")
    A, B = map(read_gains, options.files)
    one, other = A.known, B.known
    found = compared(one, other.at_currents_of(one.curves))
    check_units(A, B)
    title = "Gains A, {}, against B, {}".format(*map(one_line, options.files))
    return output.show(GainComparison.of(found, A, B).report(title), options, passed=not found.moved)


def _payload_of(
    options: argparse.Namespace,
    structure: "Structure",
    file: "GainsFile",
    unloaded: Sequence[Path],
    loaded: Sequence[Path],
    weighed: "Payload | None" = None,
) -> "Weighing":
    """Read recordings and estimate their payload, weighed or not, with the gains of a file."""
    from scenarios.gains_in_use.known_gains import weighing

    description = inputs.log_description(options, structure.arm.joint_names)
    bare, heavy = (inputs.read_unrepaired(each, description) for each in (unloaded, loaded))
    delay = options.current_delay if isinstance(options.current_delay, float) else None
    return weighing(structure, bare, heavy, file, weighed=weighed, delay=delay, policy=inputs.policy_of(options))


def payload_of_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare recordings, gains and robot."""
    add = parser.add_argument
    add("logs", type=arguments.file, nargs="+", metavar="LOG", help="recordings with the unknown payload")
    add("--unloaded", type=arguments.file, nargs="+", required=True, metavar="A", help="recordings with a bare flange")
    inputs.add_gains_argument(parser, needed=True)
    inputs.add_model_arguments(parser)
    text = "write the load for the controller: .script with URScript's set_target_payload, .json for Franka's setLoad"
    add("--out", type=arguments.load_file, metavar="FILE", help=text)
    text = "body on the last link whose frame is the controller's flange, such as tool0 or panda_link8; with --out"
    add("--frame", metavar="BODY", help=text)
    _add_limit_argument(parser)
    text = "motion with this payload that is in no LOG; status 1, and no file, if its currents are not predicted"
    add("--unseen", type=arguments.file, metavar="LOG", help=text)
    inputs.add_log_arguments(parser)
    inputs.add_delay_argument(parser)
    output.add_force_argument(parser, "; write a load that fails to predict --unseen, or of which joints disagree")


def payload_of_command(options: argparse.Namespace) -> Status:
    """Estimate an unknown payload with known gains, and write it for a controller; status 1 if it is not written."""
    claim = output.may_write(options, options.out, command="rx90 payload-of")
    if (options.out is None) != (options.frame is None):
        raise ScenarioError("--out FILE and --frame BODY: give both, or none")
    from ident.model.arm import fixed_frame
    from ident.parameters.weighing import as_load
    from ident.unseen import predict_with
    from scenarios.gains_in_use.controller_files import LOADS, in_frame
    from scenarios.gains_in_use.known_gains import check_unseen
    from scenarios.gains_in_use.weighing import FoundPayload
    from scenarios.results.gains_file import read_gains

    file, robot = read_gains(options.gains), inputs.robot_of(options, options.model)
    arm, unseen = robot.structure.arm, None
    place = None if options.frame is None else fixed_frame(robot.model, arm, options.frame)
    with output.under_way(options, "weighing"):
        found = _payload_of(options, robot.structure, file, options.unloaded, options.logs)
        load, why = as_load(found.payload.body, most=options.max_rel_std)
        if options.unseen is not None:
            if load is None:
                raise ScenarioError(f"--unseen: the payload found cannot predict a motion: {why}")
            mounted = [inputs.Mounting((options.unseen,), None)]
            (log,) = inputs.read_motions(mounted, inputs.log_description(options, arm.joint_names))
            check_unseen(file, [], [log.recording])
            unseen = predict_with(file.known, found.prepared, replace(log, payload=load))
    result = FoundPayload.of(found, unseen)
    passed = unseen is None or unseen.passed
    if claim is not None and place is not None:
        out, frame = options.out, str(options.frame)
        text = None if load is None else LOADS[out.suffix.lower()](in_frame(load, *place), frame)
        passed = passed and text is not None and not result.apart
        if text is not None and (passed or options.force):
            with claim.writing():
                out.write_text(text, encoding="utf-8")
            without = "" if why is None else f", without {why}"
            result.written, result.load = str(out), f"{out}: in the frame of {frame}{without}"
        else:
            failed = "it does not predict the motion, or the joints disagree on the mass; --force writes it"
            result.load = f"{out} NOT WRITTEN: {failed if text else why}"
    title = f"Payload of {', '.join(map(one_line, options.logs))}, with {one_line(options.gains)}"
    return output.show(result.report(title), options, passed=passed)


def torque_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare recording, gains and written file."""
    parser.add_argument("log", type=arguments.file, metavar="LOG", help="a recording")
    inputs.add_gains_argument(parser, needed=True)
    text = "Parquet file: t, and for each joint tau with the limits tau_low, tau_high (two standard deviations)"
    parser.add_argument("--out", type=arguments.parquet_file, required=True, metavar="FILE", help=text)
    inputs.add_log_arguments(parser)
    output.add_force_argument(parser)


def torque_command(options: argparse.Namespace) -> Status:
    """Write the torques of a recording."""
    claim = output.right_to_write(options, options.out, command="rx90 torque")
    from ident.estimation.known_gains import joint_torque
    from ident.recordings.files import read_log
    from scenarios.gains_in_use.known_gains import Torques, check_currents
    from scenarios.rendering.wording import joints_named
    from scenarios.results.gains_file import read_gains, write_torque

    file = read_gains(options.gains)
    names = tuple(entry.name for entry in file.gains if entry.name is not None)
    description = inputs.log_description(options, names if len(names) == len(file.gains) else None)
    (recording,) = inputs.recordings_of([read_log(options.log, description)])
    remarks = check_currents(file, recording)
    found = joint_torque(recording, file.known)
    with claim.writing():
        write_torque(found, file, options.out)
    result = Torques.of(found, file, options.out, remarks)
    title = f"{one_line(result.out)}: {result.samples} samples, {joints_named([x.joint for x in result.torques])}"
    return output.show(result.report(title), options)


def _add_limit_argument(parser: argparse.ArgumentParser) -> None:
    text = "largest relative standard deviation of a value that is written (default %(default)s)"
    parser.add_argument("--max-rel-std", type=REL_STD, default=0.1, metavar="X", help=text)


def patch_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare model, gains, bare motions and written files."""
    add = parser.add_argument
    add("model", type=arguments.file, metavar="MODEL", help="URDF or MJCF file")
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more")
    inputs.add_gains_argument(parser, needed=True)
    text = "assumed gains, on which the effort limits of MODEL are based, same format; without it, "
    add("--nominal", type=arguments.gains_file, metavar="N", help=f"{text}efforts stay unchanged")
    text = "output of identify --json for bare recordings, with friction and armature; without it both stay unchanged"
    add("--arm", type=arguments.file, metavar="A", help=text)
    text = (
        "write mass, centre and inertia of the links too; --arm must come from bare recordings identified with --gains"
    )
    add("--links", action="store_true", help=text)
    _add_limit_argument(parser)
    add("--out", type=arguments.file, required=True, metavar="FILE", help="patched copy to write")
    text = "write torque constants and, of a URDF with --nominal, effort limits as ROS 2 parameters, YAML"
    add("--ros-params", type=arguments.file, metavar="FILE", help=text)
    text = (
        "The copy is written only if it predicts the currents of LOG within the expected error, and not significantly "
        "worse than a copy with the gains of --nominal (without --nominal: than MODEL as it is); else status 1."
    )
    inputs.add_unseen_arguments(parser, text)
    inputs.add_log_arguments(parser)
    output.add_force_argument(parser, "; write a copy that fails to predict --unseen")


def patch_command(options: argparse.Namespace) -> Status:
    """Write a copy of a model with identified values, report all changes; status 1 if it predicts a motion worse."""
    from ident.model.arm import check_ending

    model, flange, most = options.model, options.flange, options.max_rel_std
    written: list[Path] = [path for path in (options.out, options.ros_params) if path is not None]
    check_ending(model)
    if options.out.suffix.lower() != model.suffix.lower():
        ending = f"a copy of {one_line(model)} ends in {one_line(model.suffix)}"
        raise ScenarioError(f"--out {one_line(options.out)}: {ending}")
    if len({path.resolve() for path in (model, *written)}) <= len(written):
        raise ScenarioError("MODEL, --out and --ros-params: expected different files")
    claim = [output.right_to_write(options, path, command="rx90 patch") for path in written]
    from ident.estimation.known_gains import check_unit
    from ident.model.structure import structure_of
    from scenarios.experiments.robots import nominal_links, read_arm
    from scenarios.gains_in_use.controller_files import ros_parameters
    from scenarios.gains_in_use.model_patch import patched_model
    from scenarios.gains_in_use.patch import NOT_BARE, Patched, joint_values, link_values, predicted_by_models
    from scenarios.results.bare import BareResult
    from scenarios.results.gains_file import read_gains
    from scenarios.results.record import read_result

    structure, gains = structure_of(read_arm(model, (), flange=flange)), read_gains(options.gains)
    nominal = None if options.nominal is None else read_gains(options.nominal)
    arm: Path | None = options.arm
    bare = None if arm is None else read_result(arm.parent, BareResult, arm.name, otherwise=NOT_BARE)
    joints = joint_values(structure, gains, nominal, bare, most=most)
    if nominal is not None:
        check_unit(gains.known, nominal.known, "--nominal")
    links = link_values(bare, gains, structure.arm, nominal_links(model, flange)) if options.links else None
    copy, changes = patched_model(model, joints, links)
    unseen, log = None, inputs.unseen_motion(options, inputs.log_description(options, structure.arm.joint_names))
    if log is not None:
        with output.under_way(options, "predicting"):
            rival = model.read_bytes()
            if nominal is not None:
                values = joint_values(structure, nominal, None, bare, most=most)
                rival, _ = patched_model(model, values, links)
            both, links = ((copy, gains), (rival, nominal)), options.links
            unseen = predicted_by_models(log, structure, *both, bare=bare, links=links, model=model, flange=flange)
    passed = unseen is None or unseen.not_worse
    efforts = {each.joint: float(each.after) for each in changes if each.attribute == "effort" and each.after}
    contents = (copy, ros_parameters(gains, structure.arm.joint_names, efforts).encode())
    for path, right, content in zip(written, claim, contents, strict=False) if passed or options.force else ():
        with right.writing():
            path.write_bytes(content)
    result = Patched(
        out=str(options.out),
        ros_params=options.ros_params and str(options.ros_params),
        changes=list(changes),
        notes=list(gains.notes),
        written=passed or options.force,
        against_nominal=nominal is not None,
        unseen=unseen,
    )
    return output.show(result.report("Patched model"), options, passed=passed)
