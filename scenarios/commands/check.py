"""`rx90 check`."""

import argparse

import scenarios.command_line.arguments as arguments
from ident.observation.observation import ObserveOptions
from scenarios.command_line.logs import add_log_arguments, add_reading_arguments, log_description, robot_of, told
from scenarios.command_line.options import add_options, chosen, policy_of
from scenarios.command_line.output import add_form_arguments, show, under_way
from scenarios.command_line.process import Status
from scenarios.command_line.writing import add_save_argument, claimed_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("robot", metavar="ROBOT", help="MJCF or URDF file, robot.toml, or the name of a built-in robot")
    said = "recordings of the robot; the first one bare if possible, the others with any payload"
    add("log", metavar="LOG", type=arguments.file, nargs="+", help=said)
    add("--loaded", metavar="B", type=arguments.file, nargs="+", default=[], help="recordings with --payload mounted")
    said = "payload of --loaded, TOML; without --loaded a planned one: forecasts each gain's standard deviation"
    add("--payload", metavar="P", type=arguments.file, help=said)
    add("--all", action="store_true", help="list all checks, and each joint's motion")
    add_reading_arguments(parser)
    add_log_arguments(parser)
    add_save_argument(parser)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)
    add_options(parser, ObserveOptions)


def main(options: argparse.Namespace) -> Status:
    """Read, check, report."""
    from threadpoolctl import threadpool_limits

    from ident.diagnosis.diagnosis import Severity
    from ident.diagnosis.motion_quality import Warmth
    from ident.estimation.gain_options import GainOptions
    from ident.identification import check
    from ident.payload.payload import read_payload
    from ident.recordings.files import read_temperatures, read_unchecked
    from ident.recordings.recording import Motion
    from scenarios.experiments.robots import model_links
    from scenarios.rendering.content import Paragraph
    from scenarios.results.check import Check
    from scenarios.results.record import save_result
    from scenarios.support.errors import ScenarioError

    if options.loaded and options.payload is None:
        raise ScenarioError("--loaded: no payload is given; describe what was mounted, --payload P.toml")
    saving = claimed_folder(options, len(options.log) + len(options.loaded), "rx90 check --save")
    limits = GainOptions()
    with under_way(options, "checking"), threadpool_limits(1):  # threads of a BLAS do not speed up small matrices
        robot = robot_of(options, options.robot)
        said = log_description(options, robot.structure.arm.joint_names)
        payload = None if options.payload is None else read_payload(options.payload)
        paths = (*options.log, *options.loaded)
        recordings = told([read_unchecked(path, said) for path in paths])
        temperatures = [read_temperatures(path, said, robot.structure.arm.n) for path in paths]
        warmths = [
            Warmth(recording.name, celsius)
            for recording, celsius in zip(recordings, temperatures, strict=True)
            if celsius is not None
        ]
        checked = check(
            recordings,
            robot.structure,
            observing=chosen(ObserveOptions, options),
            gains=limits,
            loaded=[k >= len(options.log) for k in range(len(recordings))],
            payload=payload,
            about=robot.gain,
            warmths=warmths,
            undelay=policy_of(options).undelay,
            links=model_links(robot.model, robot.flange) if options.loaded else None,
        )
    result = Check.of(checked, robot.structure.arm)
    if saving is not None:
        carried = [None] * len(options.log) + [payload] * len(options.loaded)
        with saving.writing():
            save_result(
                saving.folder,
                result,
                kind="check",
                title=f"Logs of {robot.structure.arm.name}",
                command=options.command_line,
                model=robot.model,
                flange=robot.flange,
                arm=robot.structure.arm,
                motions=list(map(Motion, recordings, carried)),
                observing=checked.observing,
                gains=limits,
                payload=payload,
                about=None if robot.gain is None else tuple(robot.gain.tolist()),
            )
    hint = Paragraph("--all lists every check, and the motion of each joint.")
    report = result.report(result.headline, *(() if options.all else (hint,)), mood=result.mood)
    show(report.in_full if options.all else report, options)
    return Status.MISSED if checked.found.severity is Severity.WRONG else Status.PASSED
