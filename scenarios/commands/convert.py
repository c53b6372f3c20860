"""`rx90 convert`."""

import argparse

import scenarios.command_line.arguments as arguments
from ident.recordings.formats.lerobot import ENDING, FILES
from scenarios.command_line.logs import add_log_arguments, log_description
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.support.errors import ScenarioError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("log", type=arguments.file, metavar="LOG", help="CSV, Parquet, NumPy, ROS 2 bag, MCAP, LeRobot dataset")
    said = "recording to write, .parquet or CSV; a folder .lerobot is a LeRobot v3 dataset of one episode"
    add("--out", type=arguments.file, required=True, metavar="FILE", help=said)
    add("--model", type=arguments.file, metavar="ROBOT", help="MJCF or URDF file that names the joints")
    add(
        "--flange",
        metavar="BODY",
        help="last body of the arm, if the file has more; joints beyond it are not part of the arm",
    )
    add_log_arguments(parser)
    add_form_arguments(parser)
    arguments.add_force_argument(parser)


def main(options: argparse.Namespace) -> Status:
    """Read, write, report the columns that were used."""
    dataset = options.out.suffix.lower() == ENDING
    folder, names = (options.out, FILES) if dataset else (options.out.parent, [options.out.name])
    if dataset and options.out.exists() and options.log.exists() and options.out.samefile(options.log):
        raise ScenarioError(f"{options.out}: rx90 convert reads this dataset and would overwrite it; give another path")
    held = right_to_write(options, folder, names, command="rx90 convert")
    from ident.diagnosis.plausibility import check_joints
    from ident.recordings.files import read_log, write_recording
    from ident.recordings.formats.lerobot import write_dataset
    from scenarios.experiments.robots import read_arm
    from scenarios.results.written import Converted

    arm = None if options.model is None else read_arm(options.model, (), flange=options.flange)
    log = read_log(options.log, log_description(options, None if arm is None else arm.joint_names))
    if arm is not None:
        check_joints(arm, log.recording)
    with held.writing():
        if dataset:
            joints = log.description.joints
            write_dataset([log.recording], options.out, joints=joints, signal=log.signal)
        else:
            write_recording(log.recording, options.out, signal=log.v)
    show(Converted.of(log, options.out).report("Log converted to a recording"), options)
    return Status.PASSED
