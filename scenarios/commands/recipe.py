"""`rx90 recipe`."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status, printable
from scenarios.command_line.writing import right_to_write
from scenarios.commands import COMMANDS
from scenarios.results.write_access import Claim

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ident.payload.payload import Payload

KEPT = "kept, but it differs from the scenario's payload; delete it and repeat the command, unless it was measured"
"""Remark on an existing payload file."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    add("scenario", metavar="SCENARIO", help="gives robot, motions, payloads and options")
    said = "page to write, Markdown; a file of each payload is written to the same folder unless it exists"
    add("--out", type=arguments.file, required=True, metavar="FILE", help=said)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Prepare the scenario, write the page, and missing payload files."""
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 recipe")
    from threadpoolctl import threadpool_limits

    from ident.diagnosis.diagnose import horizon
    from scenarios.experiments.build import setup_of
    from scenarios.experiments.files.loading import load_scenario, payloads_as_stated
    from scenarios.prediction.expected import enough, expected_preparation
    from scenarios.reports.content import Mood, Paragraph, Report
    from scenarios.reports.files import write_markdown
    from scenarios.reports.recipe import recipe_report
    from scenarios.results.written import Written
    from sim.feedforward_currents import check_torque_limits

    setup, stated = setup_of(load_scenario(options.scenario)), payloads_as_stated(options.scenario)
    check_torque_limits(setup.experiments)
    payloads = {mounting: stated[mounting] for mounting in setup.payloads if mounting in setup.protocol}
    with threadpool_limits(1):  # threads of a BLAS do not speed up small matrices, and sometimes block
        told = horizon(expected_preparation(setup, enough(setup)).logs())
    report = recipe_report(setup, payloads, options.scenario, COMMANDS, told)
    with held.writing():
        write_markdown(report, options.out)
    written, other = _write_payloads(payloads, held)
    parts = [Paragraph(printable(f"{name}: the payload as specified in the scenario")) for name in written]
    parts += [Paragraph(printable(f"{name}: {KEPT}"), Mood.DOUBTFUL) for name in other]
    result = Written.model_validate({"out": str(options.out), "payloads": written})
    title = printable(f"{options.out}: {report.title}")
    show(Report(title, tuple(parts), result.model_dump(mode="json")), options)
    return Status.PASSED


def _write_payloads(payloads: "Mapping[str, Payload]", held: Claim) -> tuple[list[str], list[str]]:
    """Write payload files; existing ones may have measured values and are kept.

    Returns:
        Written files, and kept files that differ from the scenario.
    """
    from ident.payload.files import read_payload, write_payload
    from ident.support.errors import PayloadError
    from scenarios.experiments.files.toml_text import schema_line
    from scenarios.results.run_folder import payload_file

    written, other = list[str](), list[str]()
    for mounting, payload in payloads.items():
        path = held.folder / payload_file(mounting)
        if not path.exists():
            write_payload(payload, path, comment=schema_line("payload"))
            written.append(str(path))
            continue
        try:
            same = read_payload(path) == payload
        except PayloadError:
            same = False
        if not same:
            other.append(str(path))
    return written, other
