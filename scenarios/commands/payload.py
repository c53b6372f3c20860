"""`rx90 payload`."""

import argparse

import scenarios.command_line.arguments as arguments
from scenarios.command_line.output import add_form_arguments, console, show
from scenarios.command_line.process import Status
from scenarios.command_line.writing import right_to_write

STEEL = 7850.0
DENSITY = arguments.number_from(500.0, 23000.0, "kg/m^3", "wood to tungsten")
NOMINAL = "Nominal values of a designed {shape}: weigh the finished payload and enter its mass."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add = parser.add_argument
    said = "a built-in name or TOML file: gives arm, drives, motion and what is known of the payload"
    add("scenario", metavar="SCENARIO", help=said)
    add("--out", type=arguments.file, metavar="FILE", help="payload file to write, TOML")
    said = "density of the material [kg/m^3] (default 7850, steel)"
    add("--density", type=DENSITY, default=STEEL, metavar="D", help=said)
    add("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    arguments.add_force_argument(parser)
    add_form_arguments(parser)


def main(options: argparse.Namespace) -> Status:
    """Search for the best payload of each shape, report, write its file; status 1 if a joint is not identifiable."""
    held = None
    if options.out is not None:
        held = right_to_write(options, options.out.parent, [options.out.name], command="rx90 payload")
    from ident.payload.payload import payload_from_table, write_payload
    from scenarios.design.payload_design import STEPS, design_payload
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.support.progress import progress_of
    from scenarios.support.texts import schema_line

    setup = setup_of(load_scenario(options.scenario))
    with progress_of("weights", console(options), STEPS) as say:
        design = design_payload(setup, density=options.density, seed=options.seed, tell=say.reach)
    if held is not None:
        comment = f"{schema_line('payload')}\n# {NOMINAL.format(shape=design.candidates[0].shape)}"
        with held.writing():
            write_payload(payload_from_table(design.after.payload), held.folder / held.names[0], comment=comment)
    show(design.report(f"Payload for scenario {design.scenario}"), options)
    return Status.PASSED if all(each.shown for each in design.after.joints) else Status.MISSED
