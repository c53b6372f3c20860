"""Commands on recordings: `rx90 record` prepares them, `convert` reads foreign logs, `check` detects faults."""

import argparse

from scenarios.command_line import arguments, inputs, output
from scenarios.command_line.process import Status
from scenarios.support.errors import ScenarioError

PAGE, MOTIONS = "record.md", ("motion.csv", "motion.yaml", "motion.script")
RATE = arguments.number_from(1.0, 1e4, "Hz", "sampling rates of controllers")
USUAL_RATE = 125.0
"""Supported by drivers of most arms [Hz]."""
RECORDINGS = (".parquet", ".csv", ".txt")
"""Endings of recordings that `rx90 convert` writes."""


def record_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, folder and sampling rate."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives robot, motions, payloads and options")
    text = f"folder for instructions ({PAGE}), the motion as CSV, ROS 2 YAML and URScript, and missing payload files"
    add("--out", type=arguments.folder, required=True, metavar="DIR", help=text)
    add("--rate", type=RATE, default=USUAL_RATE, metavar="HZ", help="samples per second (default %(default)g)")
    output.add_force_argument(parser)


def record_command(options: argparse.Namespace) -> Status:
    """Write instructions, the motion and missing payload files; existing ones may have measured values and are kept."""
    claim = output.right_to_write(options, options.out, (PAGE, *MOTIONS), command="rx90 record")
    from ident.diagnosis.diagnose import horizon
    from ident.payload.payload import write_payload
    from scenarios.design.record import Recorded, controller_files, instructions, sampled
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.prediction.predictor import enough, expected_preparation
    from scenarios.rendering import write_report
    from scenarios.results.run_folder import payload_file
    from sim.feedforward_currents import check_torque_limits

    setup = setup_of(load_scenario(options.scenario))
    check_torque_limits(setup.experiments)
    motion = sampled(setup, options.rate)
    expected = horizon(expected_preparation(setup, enough(setup)).logs())
    recorded, texts = Recorded.of(setup, motion), controller_files(setup, motion)
    page = instructions(setup, recorded, options.scenario, expected)
    with claim.writing():
        write_report(page, claim.folder / PAGE)
        for name, text in texts.items():
            (claim.folder / name).write_text(text, encoding="utf-8")
    recorded.files = [str(claim.folder / name) for name in (PAGE, *texts)]
    for mounting, payload in setup.payloads.items():
        path = claim.folder / payload_file(mounting)
        (recorded.kept if path.exists() else recorded.files).append(str(path))
        if not path.exists():
            write_payload(payload, path)
    return output.show(recorded.report(page.title), options)


def convert_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare log and recording."""
    add = parser.add_argument
    add("log", type=arguments.file, metavar="LOG", help="CSV, Parquet, NumPy, ROS 2 bag, MCAP, LeRobot dataset")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="recording to write, .parquet or CSV")
    text = "write what is declared of the log, TOML: the --log-description of all logs like it"
    add("--description-out", type=arguments.file, metavar="FILE", help=text)
    add("--model", type=arguments.file, metavar="ROBOT", help="MJCF or URDF file that names the joints")
    text = "last body of the arm, if the file has more; joints beyond it are not part of the arm"
    add("--flange", metavar="BODY", help=text)
    inputs.add_log_arguments(parser)
    output.add_force_argument(parser)


def convert_command(options: argparse.Namespace) -> Status:
    """Read a log, write it as a recording, report the columns that were used."""
    out = options.out
    if out.suffix.lower() not in RECORDINGS:
        raise ScenarioError(f"{out}: unknown ending {out.suffix!r} of a recording; known: {', '.join(RECORDINGS)}")
    claim = output.right_to_write(options, out, command="rx90 convert")
    described = output.may_write(options, options.description_out, command="rx90 convert")
    from ident.diagnosis.plausibility import check_joints
    from ident.recordings.files import read_log, write_recording
    from scenarios.experiments.robots import read_arm
    from scenarios.results.written import Converted, description_text

    arm = None if options.model is None else read_arm(options.model, (), flange=options.flange)
    description = inputs.log_description(options, None if arm is None else arm.joint_names)
    log = read_log(options.log, description)
    if arm is not None:
        check_joints(arm, log.recording)
    named, joints = len(description.joints or ()), log.recording.q.shape[1]
    if named not in (0, joints):
        fault = f"{named} joints are named, but the log has {joints}; name each one (--joints)"
        raise ScenarioError(f"{options.log}: {fault}")
    with claim.writing():
        write_recording(log.recording, out, signal=log.v)
    if described is not None:
        with described.writing():
            options.description_out.write_text(description_text(description), encoding="utf-8")
    converted = Converted.of(log, out, options.description_out)
    return output.show(converted.report("Log converted to a recording"), options)


def check_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare robot, logs and filters."""
    from ident.observation.observation import ObserveOptions

    add = parser.add_argument
    add("robot", metavar="ROBOT", help="MJCF or URDF file, robot.toml, or the name of a built-in robot")
    text = "recordings of the robot; the first one bare if possible, the others with any payload"
    add("log", metavar="LOG", type=arguments.file, nargs="+", help=text)
    add("--loaded", metavar="B", type=arguments.file, nargs="+", default=[], help="recordings with --payload mounted")
    text = "payload of --loaded, TOML; without --loaded a planned one: forecasts each gain's standard deviation"
    add("--payload", metavar="P", type=arguments.file, help=text)
    add("--all", action="store_true", help="list all checks, the faults that the logs exclude, and each joint's motion")
    inputs.add_reading_arguments(parser)
    inputs.add_log_arguments(parser)
    output.add_save_argument(parser)
    output.add_force_argument(parser)
    inputs.add_options(parser, ObserveOptions)


def check_command(options: argparse.Namespace) -> Status:
    """Read recordings and report their faults; status 1 if there is one."""
    from ident.diagnosis.diagnosis import Severity
    from ident.diagnosis.motion_quality import Warmth
    from ident.estimation.problem import GainOptions
    from ident.identification import check
    from ident.observation.observation import ObserveOptions
    from ident.payload.payload import read_payload
    from ident.recordings.files import read_temperatures
    from ident.recordings.recording import Motion
    from scenarios.experiments.robots import model_links
    from scenarios.rendering.content import Paragraph
    from scenarios.results.check import Check
    from scenarios.results.problem_folder import GivenProblem
    from scenarios.results.record import save_result, saved_files

    paths, limits = (*options.log, *options.loaded), GainOptions()
    if options.loaded and options.payload is None:
        raise ScenarioError("--loaded: no payload is given; describe what was mounted, --payload P.toml")
    saving = output.may_write(options, options.save, saved_files(len(paths)), command="rx90 check --save")
    with output.under_way(options, "checking"):
        robot = inputs.robot_of(options, options.robot)
        arm = robot.structure.arm
        description = inputs.log_description(options, arm.joint_names)
        payload = None if options.payload is None else read_payload(options.payload)
        recordings = inputs.read_unrepaired(paths, description)
        checked = check(
            recordings,
            robot.structure,
            observing=inputs.chosen(ObserveOptions, options),
            gains=limits,
            loaded=[k >= len(options.log) for k in range(len(paths))],
            payload=payload,
            about=robot.gain,
            warmths=[
                Warmth(recording.name, celsius)
                for recording, path in zip(recordings, paths, strict=True)
                if (celsius := read_temperatures(path, description, arm.n)) is not None
            ],
            undelay=inputs.policy_of(options).undelay,
            links=model_links(robot.model, robot.flange) if options.loaded else None,
        )
    result = Check.of(checked, arm)
    if saving is not None:
        motions = list(map(Motion, recordings, [None] * len(options.log) + [payload] * len(options.loaded)))
        model, flange, observing = robot.model, robot.flange, checked.observing
        origin = GivenProblem(model=model, flange=flange, arm=arm, motions=motions, observing=observing, gains=limits)
        title, command = f"Logs of {arm.name}", options.command_line
        with saving.writing():
            save_result(saving.folder, result, origin, kind="check", title=title, command=command, payload=payload)
    hint = [Paragraph("--all lists every check, the faults that these logs exclude, and the motion of each joint.")]
    short = not options.all and output.form(options) == "text"  # the other formats list them
    report = result.report(result.headline, *(hint if short else ()), mood=result.mood)
    wrong = checked.found.severity is Severity.WRONG
    return output.show(report.in_full if options.all else report, options, passed=not wrong)
