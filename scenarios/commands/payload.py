"""`rx90 payload`."""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, console, show
from scenarios.command_line.process import Status
from scenarios.command_line.searching import add_search_arguments, check_harmonics, kept_of, searched
from scenarios.command_line.writing import right_to_write

if TYPE_CHECKING:
    from scenarios.design.payload_design import PayloadDesign
    from sim.trajectory import FourierTrajectory

STEEL = 7850.0
TEXT = "payload.md"
FILES = ("payload.toml", "scenario.toml", TEXT, "payload-drawing.png", "payload-drawing.svg")
MOTION = ("motion.toml",)
DENSITY = arguments.number_from(500.0, 23000.0, "kg/m^3", "wood to tungsten")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    said = "a built-in name or TOML file: gives arm, drives, motion and what is known of the payload"
    add("scenario", metavar="SCENARIO", help=said)
    add("--out", type=arguments.folder, metavar="DIR", help="folder for payload file, drawing and scenario")
    add(
        "--density",
        type=DENSITY,
        default=STEEL,
        metavar="D",
        help="density of the material [kg/m^3] (default 7850, steel)",
    )
    add("--excite", action="store_true", help="also search a motion for the payload; options of that search:")
    add_search_arguments(parser)
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Search for the best payload of each shape, report, write the files; status 1 if a joint is not identifiable."""
    check_harmonics(options)
    held = None
    if options.out is not None:
        names = FILES + MOTION * options.excite
        held = right_to_write(options, options.out, names, command="rx90 payload")
    from scenarios.design.payload_design import STEPS, design_payload
    from scenarios.design.payload_folder import write_payload_folder
    from scenarios.experiments.build import setup_of
    from scenarios.experiments.files.loading import load_scenario
    from scenarios.reports.files import write_figures, write_markdown
    from scenarios.reports.payload import payload_report
    from scenarios.support.progress import progress_of

    setup, motion = setup_of(load_scenario(options.scenario)), None
    with progress_of("weights", console(options), STEPS) as say:
        found = design_payload(setup, density=options.density, seed=options.seed, tell=say.reach)
    if options.excite:
        found, motion = _excited(found, options)
    report = payload_report(found, options.out)
    if held is not None:
        with held.writing():
            write_payload_folder(found, options.scenario, motion, held.folder)
            write_figures(report, held.folder)
            write_markdown(report, held.folder / TEXT)
    show(report, options)
    return Status.PASSED if found.shows(found.after.deviations)[found.joints].all() else Status.MISSED


def _excited(found: "PayloadDesign", options: argparse.Namespace) -> "tuple[PayloadDesign, FourierTrajectory]":
    """Return the design with a motion searched for its payload, and that motion."""
    from scenarios.design.excitation import Design
    from scenarios.design.fitting import best_fitted
    from scenarios.design.search import Series

    carrying, best = found.carrying, found.best
    design = Design(carrying.problem_with(best.weight, best.payload))
    series = Series(limits=design.problem.limits, harmonics=options.harmonics, duration=options.duration)
    motion, _ = best_fitted(design, series, kept_of(searched(design, series, options, None)))
    return replace(found, again=replace(carrying, motion=motion).candidate(best.weight)), motion
