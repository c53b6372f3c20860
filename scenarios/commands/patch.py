"""`rx90 patch`."""

import argparse
from collections.abc import Sequence
from pathlib import Path

import scenarios.command_line.arguments as arguments
import scenarios.command_line.gains as gains_arguments
from ident.support.naming import one_line
from scenarios.command_line.gains import add_gains_argument
from scenarios.command_line.logs import add_log_arguments, add_unseen_arguments, log_description, unseen_log
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.support.errors import ScenarioError

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
    from scenarios.experiments.gains_file import read_gains
    from scenarios.experiments.robots import nominal_links, read_arm
    from scenarios.gains_in_use.model_patch import patched_model
    from scenarios.gains_in_use.model_values import joint_values, link_values, read_bare
    from scenarios.gains_in_use.patched import Patched, predicted_by_models
    from scenarios.results.ros_parameters import ros_parameters

    model, flange, most = options.model, options.flange, options.max_rel_std
    structure, gains = structure_of(read_arm(model, (), flange=flange)), read_gains(options.gains)
    nominal = None if options.nominal is None else read_gains(options.nominal)
    bare = None if options.arm is None else read_bare(options.arm)
    joints = joint_values(structure, gains, nominal, bare, most=most)
    if nominal is not None:
        check_unit(gains.known, nominal.known, "--nominal")
    links = link_values(bare, gains, structure.arm, nominal_links(model, flange)) if options.links else None
    copy, changes = patched_model(model, joints, links)
    unseen = None
    with under_way(options, "predicting"):
        if (log := unseen_log(options, log_description(options, structure.arm.joint_names))) is not None:
            rival = model.read_bytes()
            if nominal is not None:
                rival, _ = patched_model(model, joint_values(structure, nominal, None, bare, most=most), links)
            contents = (copy, gains), (rival, nominal)
            unseen = predicted_by_models(
                log, structure, contents, gains=gains, bare=bare, links=options.links, model=model, flange=flange
            )
    contents = [copy]
    if options.ros_params is not None:
        contents.append(ros_parameters(gains, structure.arm.joint_names).encode())
    passed = unseen is None or unseen.not_worse
    for path, right, content in zip(written, held, contents, strict=True) if passed or options.force else ():
        with right.writing():
            path.write_bytes(content)
    result = Patched(
        out=str(options.out),
        ros_params=None if options.ros_params is None else str(options.ros_params),
        changes=list(changes),
        notes=list(gains.notes),
        written=passed or options.force,
        against_nominal=nominal is not None,
        unseen=unseen,
    )
    show(result.report("Patched model"), options)
    return Status.PASSED if passed else Status.MISSED


def _check_files(model: Path, written: Sequence[Path]) -> None:
    """Check that copy and model have the same ending, and that no file is written twice or over the model."""
    from ident.model.arm import check_ending

    check_ending(model)
    if written[0].suffix.lower() != model.suffix.lower():
        raise ScenarioError(
            f"--out {one_line(written[0])}: a copy of {one_line(model)} ends in {one_line(model.suffix)}"
        )
    places = [path.resolve() for path in (model, *written)]
    if len(set(places)) < len(places):
        raise ScenarioError("MODEL, --out and --ros-params: expected different files")
