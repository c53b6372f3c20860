"""The command line `rx90`: 0 passed, 1 a tolerance was missed, 2 bad input (one line on stderr)."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import NoReturn

import numpy as np
from rich.console import Console
from threadpoolctl import threadpool_limits

import scenarios.commands.arguments as arguments
from ident.errors import IdentificationError
from ident.gains import GainOptions
from ident.identify import METHODS, identify
from ident.observation import ObserveOptions
from ident.payload_files import read_payload
from ident.recording_files import read_recording
from ident.structure import structure_of
from scenarios.build import bench
from scenarios.commands.studies import run_monte_carlo, run_sensitivity
from scenarios.errors import ScenarioError
from scenarios.files.motions import write_motion
from scenarios.files.schema import load_scenario
from scenarios.files.tables import builtin_names
from scenarios.reports.run import print_estimate, print_list, print_run
from scenarios.robot_models import read_arm
from scenarios.run import run
from scenarios.store.run_folder import estimate_document, identify_command, run_document, save_run, to_json
from sim.errors import SimulationError

PASSED, MISSED, BAD_INPUT = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Without the program's name; those of the process if None.

    Returns:
        The exit status; a command line that cannot be parsed exits at once with status 2.
    """
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace, Console], int] = options.command
    try:
        with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS, and stall now and then
            return command(options, _console())
    except (IdentificationError, SimulationError, ScenarioError) as error:
        print(f"rx90: {error}", file=sys.stderr)  # noqa: T201
    except BrokenPipeError:
        raise
    except OSError as error:
        print(f"rx90: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)  # noqa: T201
    return BAD_INPUT


def _list(options: argparse.Namespace, console: Console) -> int:
    print_list([(name, load_scenario(name).table.description) for name in builtin_names()], console)
    return PASSED


def _run(options: argparse.Namespace, console: Console) -> int:
    result = run(bench(load_scenario(options.scenario)), options.seed)
    if options.save is not None:
        save_run(result, options.save)
    if options.json:
        console.out(to_json(run_document(result)), highlight=False)
    else:
        print_run(result, console)
        if options.save is not None:
            console.print(f"Saved in {options.save}. The same estimate from these files:")
            console.print(identify_command(result, options.save), soft_wrap=True)
    return PASSED if result.verdict.passed else MISSED


def _identify(options: argparse.Namespace, console: Console) -> int:
    structure = structure_of(read_arm(options.model, tuple((i - 1, j - 1) for i, j in options.coupling)))
    unloaded, loaded = read_recording(options.unloaded), read_recording(options.loaded)
    payload = read_payload(options.payload)
    started = time.perf_counter()
    estimate, notes = identify(
        unloaded,
        loaded,
        structure,
        payload,
        method=options.method,
        observing=ObserveOptions(**{field.name: getattr(options, field.name) for field in fields(ObserveOptions)}),
        gains=GainOptions(**{field.name: getattr(options, field.name) for field in fields(GainOptions)}),
    )
    if options.json:
        for note in notes:
            print(f"rx90: {note}", file=sys.stderr)  # noqa: T201
        console.out(to_json(estimate_document(estimate, time.perf_counter() - started)), highlight=False)
    else:
        print_estimate(estimate, notes, console)
    return PASSED


def _paper(options: argparse.Namespace, console: Console) -> int:
    from scenarios.paper.experiment import run_paper  # pandas and matplotlib are needed here alone
    from scenarios.reports.paper import paper_document, print_paper, write_paper

    result = run_paper(options.seed)
    if options.out is not None:
        write_paper(result, options.out)
    if options.json:
        console.out(to_json(paper_document(result)), highlight=False)
    else:
        print_paper(result, console)
    return PASSED if result.passed else MISSED


def _excite(options: argparse.Namespace, console: Console) -> int:
    from scenarios.design.excitation import START, Design, robot_limits, search  # CMA-ES is needed here alone

    if not options.out.parent.is_dir():
        raise ScenarioError(f"{options.out}: no such folder as {options.out.parent}; make it first")
    prepared = bench(load_scenario(options.scenario))
    plant = prepared.experiments[0].plant
    wanted = np.flatnonzero(prepared.scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise ScenarioError(f"{options.scenario}: tolerance.identifiable wants no joint's gain")
    design = Design(plant, prepared.structure, robot_limits(plant), wanted)
    motion = search(
        design,
        START,
        options.seed,
        harmonics=options.harmonics,
        duration=options.duration,
        evaluations=options.evaluations,
        progress=lambda text: print(f"rx90: {text}", file=sys.stderr),  # noqa: T201
    )
    found = 100.0 * design.predicted_std(motion)[0]
    command = (
        f"rx90 excite {options.scenario} --seed {options.seed} --harmonics {options.harmonics} "
        f"--duration {options.duration:g} --evaluations {options.evaluations} --out FILE"
    )
    predicted = ", ".join(f"{std:.2g}" for std in found)
    comments = [
        f"Found by: {command}",
        f"Predicted standard deviation of the gains [%], joints 1 to {len(found)}: {predicted}",
        "(for a residual of 2 % of each joint's rms torque at 20 rows a second)",
    ]
    write_motion(motion, options.out, comments)
    console.print(f"{options.out}: predicted standard deviation of the gains [%]: {predicted}")
    return PASSED


def _console() -> Console:
    """A console that wraps at words on a terminal, and not at all into a pipe or file."""
    if sys.stdout.isatty():
        return _Console(highlight=False, markup=False)
    return _Console(highlight=False, markup=False, soft_wrap=True, width=200)


class _Console(Console):
    """A console whose reader may leave."""

    def on_broken_pipe(self) -> None:
        """Leave the exit status to `__main__`; Rich would say 1, which is a missed tolerance here."""
        raise BrokenPipeError


class _OneLineParser(argparse.ArgumentParser):
    """A parser whose complaints are one line."""

    def error(self, message: str) -> NoReturn:
        """Complain and exit with status 2."""
        print(f"{self.prog}: {message}; see {self.prog} --help", file=sys.stderr)  # noqa: T201
        sys.exit(BAD_INPUT)


def _parser() -> argparse.ArgumentParser:
    parser = _OneLineParser(prog="rx90", description="Testbench and identification of robot drive gains.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = commands.add_parser("list", help="built-in scenarios, a line each")
    listing.set_defaults(command=_list)

    running = commands.add_parser("run", help="simulate a scenario, identify its gains, judge them")
    running.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    running.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    running.add_argument("--save", type=Path, metavar="DIR", help="write recordings, payload, truth and result there")
    running.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    running.set_defaults(command=_run)

    repeating = commands.add_parser("paper", help="repeat the paper's experiment: tables 2 to 4, figure 3")
    repeating.add_argument("--out", type=Path, metavar="DIR", help="write paper.md, figures and raw numbers there")
    repeating.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    repeating.add_argument("--json", action="store_true", help="print one JSON object instead of tables")
    repeating.set_defaults(command=_paper)

    sampling = commands.add_parser("monte-carlo", help="repeat a scenario many times: errors, coverage, pass rates")
    sampling.add_argument(
        "-n", type=arguments.count, required=True, dest="trials", metavar="N", help="number of trials"
    )
    sampling.set_defaults(command=run_monte_carlo)
    budgeting = commands.add_parser("sensitivity", help="error budget of a scenario: which error source costs how much")
    budgeting.add_argument(
        "--repeats", type=arguments.count, default=16, help="trials of each source alone, a power of 2 (default 16)"
    )
    budgeting.add_argument(
        "--samples", type=arguments.count, default=64, help="rows of the Sobol design, a power of 2 (default 64)"
    )
    budgeting.set_defaults(command=run_sensitivity)
    for studying in (sampling, budgeting):
        studying.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
        studying.add_argument(
            "--out",
            type=arguments.folder,
            required=True,
            metavar="DIR",
            help="folder of the study; what it already holds is kept",
        )
        studying.add_argument("--seed", type=arguments.seed, default=0, help="seed of the first trial (default 0)")
        where = studying.add_mutually_exclusive_group()
        where.add_argument(
            "--jobs", type=arguments.count, metavar="J", help="processes on this machine (default: one a core)"
        )
        where.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster, tcp://HOST:PORT or its file")

    exciting = commands.add_parser("excite", help="search for a motion that shows a scenario's gains best")
    exciting.add_argument("scenario", metavar="SCENARIO", help="gives arm, drives, payload and wanted joints")
    exciting.add_argument("--out", type=Path, required=True, metavar="FILE", help="motion file to write, TOML")
    exciting.add_argument("--seed", type=arguments.seed, default=0, help="seed of the search (default 0)")
    exciting.add_argument(
        "--harmonics", type=arguments.harmonics, default=20, help="harmonics of the series (default 20)"
    )
    exciting.add_argument("--duration", type=arguments.positive, default=20.0, help="period [s] (default 20)")
    exciting.add_argument("--evaluations", type=arguments.count, default=40000, help="motions to try (default 40000)")
    exciting.set_defaults(command=_excite)

    identifying = commands.add_parser("identify", help="identify the gains of a robot from two recordings")
    identifying.add_argument("--model", type=Path, required=True, metavar="ROBOT", help="MJCF or URDF file")
    identifying.add_argument("--unloaded", type=Path, required=True, metavar="A", help="recording with a bare flange")
    identifying.add_argument("--loaded", type=Path, required=True, metavar="B", help="recording with the payload")
    identifying.add_argument("--payload", type=Path, required=True, metavar="P", help="payload description, TOML")
    identifying.add_argument(
        "--coupling",
        type=arguments.count,
        nargs=2,
        action="append",
        default=[],
        metavar=("I", "J"),
        help="motor J turns with the sum of joints I and J, as 5 6 on Staubli wrists",
    )
    identifying.add_argument("--method", choices=METHODS, default="ls-2011", help="estimator (default %(default)s)")
    identifying.add_argument("--json", action="store_true", help="print one JSON object instead of a table")
    for defaults in (ObserveOptions(), GainOptions()):
        for field in fields(defaults):
            identifying.add_argument(
                f"--{field.name.replace('_', '-')}",
                type=arguments.not_negative,
                default=getattr(defaults, field.name),
                metavar="X",
                help=f"{OPTION_HELP[field.name]} (default %(default)s)",
            )
    identifying.set_defaults(command=_identify)
    return parser


OPTION_HELP = {
    "cutoff_hz": "low-pass of the positions [Hz]",
    "decimation_cutoff_hz": "low-pass of currents and regressor [Hz]",
    "rows_per_second": "rows kept a second",
    "reversal_speed": "leave out samples slower than this share of a joint's rms speed",
    "current_delay": "time from the stamp of a current to the middle of its action [s]",
    "min_weight": "leave out rows that keep less than this share of their samples",
    "max_rel_std": "refuse a gain whose predicted relative standard deviation exceeds this",
    "noise_floor": "residual that a prediction assumes at least, as a share of the joint's rms current",
    "serial_s": "time after which residuals are taken as unrelated [s]",
    "rank_tol": "smallest relative singular value that counts as observed",
}
