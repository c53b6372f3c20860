"""`rx90 record`."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.commands import COMMANDS

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from ident.payload.payload import Payload

PAGE = "record.md"
WRITTEN = (PAGE, "motion.csv", "motion.yaml", "motion.script")
RATE = 125.0
"""Default sampling rate, supported by drivers of most arms [Hz]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives robot, motions, payloads and options")
    said = f"folder for instructions ({PAGE}), the motion as CSV, ROS 2 YAML and URScript, and missing payload files"
    add("--out", type=arguments.folder, required=True, metavar="DIR", help=said)
    within = arguments.number_from(1.0, 1e4, "Hz", "sampling rates of controllers")
    add("--rate", type=within, default=RATE, metavar="HZ", help="samples per second (default %(default)g)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Prepare the scenario, write the instructions, the motion and missing payload files."""
    held = right_to_write(options, options.out, WRITTEN, command="rx90 record")
    from threadpoolctl import threadpool_limits

    from ident.diagnosis.diagnose import horizon
    from scenarios.design.record import Recorded, controller_files, instructions, sampled
    from scenarios.experiments.scenario import load_scenario, scenario_as_stated, setup_of, stated_payloads
    from scenarios.prediction.predictor import enough, expected_preparation
    from scenarios.rendering import write_report
    from sim.feedforward_currents import check_torque_limits

    setup, stated = setup_of(load_scenario(options.scenario)), stated_payloads(scenario_as_stated(options.scenario))
    check_torque_limits(setup.experiments)
    motion = sampled(setup, options.rate)
    payloads = {mounting: stated[mounting] for mounting in setup.payloads if mounting in setup.protocol}
    with threadpool_limits(1):  # threads of a BLAS do not speed up small matrices, and sometimes block
        expected = horizon(expected_preparation(setup, enough(setup)).logs())
    recorded, texts = Recorded.of(setup, motion), controller_files(setup, motion)
    page = instructions(setup, recorded, payloads, options.scenario, COMMANDS, expected)
    with held.writing():
        write_report(page, held.folder / PAGE)
        for name, text in texts.items():
            (held.folder / name).write_text(text, encoding="utf-8")
    written, different = _write_payloads(payloads, held.folder)
    recorded.files = [*(str(held.folder / name) for name in (PAGE, *texts)), *written]
    recorded.kept = different
    show(recorded.report(page.title), options)
    return Status.PASSED


def _write_payloads(payloads: "Mapping[str, Payload]", folder: "Path") -> tuple[list[str], list[str]]:
    """Write payload files; existing ones may have measured values and are kept.

    Returns:
        Written files, and kept files that differ from the scenario.
    """
    from ident.payload.payload import read_payload, write_payload
    from ident.support.errors import PayloadError
    from scenarios.results.run_folder import payload_file
    from scenarios.support.texts import schema_line

    written, different = list[str](), list[str]()
    for mounting, payload in payloads.items():
        path = folder / payload_file(mounting)
        if not path.exists():
            write_payload(payload, path, comment=schema_line("payload"))
            written.append(str(path))
            continue
        try:
            same = read_payload(path) == payload
        except PayloadError:
            same = False
        if not same:
            different.append(str(path))
    return written, different
