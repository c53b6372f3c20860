"""`rx90 trajectory`."""

import argparse
from pathlib import Path

import scenarios.command_line.arguments as arguments
from ident.support.naming import one_line
from scenarios.command_line.output import add_form_arguments, show
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write
from scenarios.design.motion_formats import ENDINGS, FORMATS
from scenarios.support.errors import ScenarioError

RATE = 125.0
"""Default sampling rate, supported by drivers of most arms [Hz]."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments; `--format` and `--json` are those of the report."""
    add = parser.add_argument
    add("source", metavar="MOTION", help="a scenario, or a motion file as excite writes it")
    add("--out", type=arguments.file, required=True, metavar="FILE", help="file to write: .csv, .yaml or .script")
    forms = "; ".join(f"{name}: {what}" for name, (what, _) in FORMATS.items())
    add("--as", dest="form", metavar="F", choices=FORMATS, help=f"{forms} (default by the ending of FILE)")
    within = arguments.number_from(1.0, 1e4, "Hz", "sampling rates of controllers")
    add("--rate", type=within, default=RATE, metavar="HZ", help="samples per second (default %(default)g)")
    add("--model", type=arguments.file, metavar="ROBOT", help="MJCF or URDF that names the joints, for a motion file")
    add("--flange", metavar="BODY", help="last body of the arm, if the file has more")
    add_form_arguments(parser)
    arguments.add_force_argument(parser)


def main(options: argparse.Namespace) -> Status:
    """Sample, write, report the motion of each joint."""
    form = options.form or _form(options.out)
    held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 trajectory")
    from scenarios.design.trajectory_source import from_source
    from scenarios.reports.trajectory import trajectory_report

    source = from_source(options.source, options.model, options.flange)
    motion = source.sampled(options.rate)
    _, written = FORMATS[form]
    text = written(motion)
    with held.writing():
        options.out.write_text(text, encoding="utf-8")
    show(trajectory_report(motion, source.limits, options.out, form), options)
    return Status.PASSED


def _form(out: Path) -> str:
    if out.suffix.lower() not in ENDINGS:
        raise ScenarioError(f"--out {one_line(out)}: expected an ending {', '.join(ENDINGS)}, or --as FORM")
    return ENDINGS[out.suffix.lower()]
