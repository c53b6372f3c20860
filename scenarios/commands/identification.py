"""Commands that identify gains: `rx90 identify` from recordings, `run` from a simulation, `paper` as the paper does."""

import argparse
from typing import TYPE_CHECKING

from scenarios.command_line import arguments, inputs, output
from scenarios.command_line.process import Status, complain
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.rendering.content import Paragraph
    from scenarios.results.gains_file import GainsFile

TEXT = "paper.md"


def add_gains_out(parser: argparse.ArgumentParser) -> None:
    """Declare the file of identified gains."""
    text = "write the gains with covariance and origin, .toml or .json"
    parser.add_argument("--gains-out", type=arguments.gains_file, metavar="FILE", help=text)
    output.add_force_argument(parser)


def _write_gains(file: "GainsFile", claim: output.Claim) -> None:
    from scenarios.results.gains_file import gains_text

    path = claim.folder / claim.names[0]
    with claim.writing():
        path.write_text(gains_text(file, path.suffix), encoding="utf-8")


def _written(claim: output.Claim | None) -> "tuple[Paragraph, ...]":
    from scenarios.rendering.content import Paragraph

    return () if claim is None else (Paragraph(f"Gains written to {claim.place}."),)


def run_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare scenario, seed and written files."""
    parser.add_argument("scenario", metavar="SCENARIO", help="a built-in name or the path of a TOML file")
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    text = "folder for recordings, payloads, true values and result"
    parser.add_argument("--save", "--out", type=arguments.folder, metavar="DIR", help=text)
    add_gains_out(parser)


def run_command(options: argparse.Namespace) -> Status:
    """Simulate, identify, judge; status 1 if a tolerance is missed."""
    from scenarios.experiments.run import run
    from scenarios.experiments.scenario import load_scenario, setup_of
    from scenarios.rendering.content import Line, Paragraph
    from scenarios.results.gains import Result
    from scenarios.results.gains_file import gains_file
    from scenarios.results.run_folder import identify_command, run_files, save_run, simulated_problem

    setup, more = setup_of(load_scenario(options.scenario)), ()
    saving = output.may_write(options, options.save, run_files(setup), command="rx90 run --save")
    gains = output.may_write(options, options.gains_out, command="rx90 run")
    with output.under_way(options, "preparing") as stages:
        result = run(setup, options.seed, stages=stages)
    if gains is not None:
        _write_gains(gains_file(result.estimate, simulated_problem(setup, result.recordings)), gains)
    if saving is not None:
        with saving.writing():
            save_run(result, saving.folder, command=options.command_line, named=options.scenario)
        saved = Paragraph(f"Saved in {options.save}. To repeat the estimate from these files:")
        more = (saved, Line(identify_command(result.setup, saving.folder)))
    more += _written(gains)
    title = f"Scenario {setup.scenario.name}, seed {options.seed}: {setup.scenario.table.description}"
    return output.show(Result.of_run(result).report(title, *more), options, passed=result.passed)


def paper_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare folder and seed."""
    text = "write paper.md and raw numbers there"
    parser.add_argument("--out", type=arguments.folder, metavar="DIR", help=text)
    parser.add_argument("--seed", type=arguments.seed, default=0, help="seed of every random number (default 0)")
    output.add_force_argument(parser)


def paper_command(options: argparse.Namespace) -> Status:
    """Repeat the paper's experiment; status 1 if a claim fails."""
    from scenarios.benchmark.paper import FILES, run_paper, write_paper
    from scenarios.rendering import write_report

    claim = output.may_write(options, options.out, (TEXT, *FILES), command="rx90 paper --out")
    with output.under_way(options, "preparing") as stages:
        run = run_paper(options.seed, stages=stages)
    found = run.result
    report = found.report(found.title(run.seed))
    if claim is not None:
        with claim.writing():
            write_report(report, claim.folder / TEXT)
            write_paper(run, claim.folder, command=options.command_line)
    return output.show(report, options, passed=found.passed)


def identify_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare robot, recordings, method and options, whose help is from the docstrings of their classes."""
    from ident.estimation.estimators import DEFAULT, ESTIMATORS
    from ident.estimation.problem import GainOptions
    from ident.observation.observation import ObserveOptions

    add = parser.add_argument
    inputs.add_model_arguments(parser)
    inputs.add_motion_arguments(parser)
    inputs.add_log_arguments(parser)
    known = ", ".join(ESTIMATORS)
    add("--method", metavar="M", choices=ESTIMATORS, default=DEFAULT, help=f"estimator: {known} (default %(default)s)")
    add("--option", action="append", default=[], metavar="KEY=VALUE", help="an option of the method; repeatable")
    inputs.add_gains_argument(parser, needed=False, text="for bare recordings only: known or assumed gains")
    text = "assumed gains, a file or numbers such as 12,12,10: changes from them, and the payload that they give"
    add("--compare-with", type=arguments.gains_or_numbers, metavar="G", help=text)
    text = "Predicted with the identified gains; with --compare-with, status 1 unless these predict it better."
    inputs.add_unseen_arguments(parser, text)
    output.add_save_argument(parser)
    add_gains_out(parser)
    for kind in (ObserveOptions, GainOptions):
        inputs.add_options(parser, kind)


def identify_command(options: argparse.Namespace) -> Status:
    """Identify gains, or their ratios from bare recordings alone; status 1 if other gains predict a motion as well."""
    import time
    from dataclasses import replace

    from ident.estimation.estimators import ESTIMATORS
    from ident.estimation.known_gains import check_comparable, estimated_gains
    from ident.estimation.problem import GainOptions
    from ident.identification import identify
    from ident.observation.observation import ObserveOptions
    from ident.parameters.weighing import outcome_of_other_gains
    from ident.support.options import options_from_words
    from ident.unseen import predict_unseen
    from scenarios.experiments.robots import model_links
    from scenarios.gains_in_use.known_gains import bare_result
    from scenarios.rendering.content import Paragraph
    from scenarios.results.fit import fit_of
    from scenarios.results.gains import Result
    from scenarios.results.gains_file import gains_file
    from scenarios.results.problem_folder import GivenProblem
    from scenarios.results.record import save_result, saved_files

    mounted = inputs.mountings(options.given)
    bare = is_bare(options, loaded=any(each.payload is not None for each in mounted))
    claim = output.may_write(options, options.gains_out, command="rx90 identify")
    names = saved_files(sum(len(each.recordings) for each in mounted))
    saving = output.may_write(options, options.save, names, command="rx90 identify --save")
    with output.under_way(options, "reading"):
        robot = inputs.robot_of(options, options.model)
        arm = robot.structure.arm
        description = inputs.log_description(options, arm.joint_names)
        motions, log = inputs.read_motions(mounted, description), inputs.unseen_motion(options, description)
    own = options_from_words(ESTIMATORS[options.method].options, options.option)
    given, policy = options.gains if bare else options.compare_with, inputs.policy_of(options)
    known = None if given is None else inputs.known_gains(given, arm)
    observing, limits = inputs.chosen(ObserveOptions, options), inputs.chosen(GainOptions, options)
    problem = GivenProblem(
        model=robot.model,
        flange=robot.flange,
        arm=arm,
        motions=motions,
        observing=observing,
        gains=limits,
        method=options.method,
        options=own,
    )
    fit, passed, kind, title = None, True, "bare", f"Bare motions of {arm.name}"
    with output.under_way(options, "identifying"):
        if bare:
            result, observing = bare_result(problem, robot, known, policy)
            problem = replace(problem, observing=observing)
        else:
            kind, title = "identification", f"Drive gains of {arm.name} by {options.method}"
            started = time.perf_counter()
            found = identify(
                robot.structure,
                motions,
                method=options.method,
                options=own,
                observing=observing,
                gains=limits,
                policy=policy,
                links=model_links(robot.model, robot.flange),
            )
            identify_s, problem = time.perf_counter() - started, replace(problem, observing=found.observing)
            assert found.prepared is not None, "an identification has what it was found from"
            if known is not None:
                check_comparable(estimated_gains(found.estimate), known)
            cost = None if known is None else outcome_of_other_gains(found.prepared.problem, known, own, found.estimate)
            unseen = None if log is None else predict_unseen(found, log, other=known)
            result, passed = Result.of_identification(found, identify_s, cost, unseen), unseen is None or unseen.passed
            fit = None if saving is None else fit_of(found.prepared, found.estimate)
            if claim is not None:
                _write_gains(gains_file(found.estimate, problem), claim)
            for words in (*(each.sentence for each in found.found.reported), *found.notes):
                if output.form(options) == "json":
                    complain(words)
    more = [] if saving is None else [Paragraph(f"Saved in {saving.place}; as a page: rx90 report {saving.place}")]
    if saving is not None:
        with saving.writing():
            command, gains = options.command_line, options.gains
            save_result(
                saving.folder, result, problem, kind=kind, title=title, command=command, believed=gains, fit=fit
            )
    return output.show(result.report(title, *more, *_written(claim)), options, passed=passed)


def is_bare(options: argparse.Namespace, *, loaded: bool) -> bool:
    """Return whether no payload or option scales the gains; raises `ScenarioError` if an option does not apply."""
    from ident.estimation.estimators.nls import NAME

    bare = not loaded and not any("gain" in word.partition("=")[0] for word in options.option)
    why = "for bare recordings only; loaded recordings identify the gains, so remove it"
    if bare:
        why = "bare recordings give only ratios of gains; add --loaded B --payload P.toml"
    for name in ("compare_with", "unseen", "gains_out") if bare else ("gains",):
        if getattr(options, name):
            raise ScenarioError(f"--{name.replace('_', '-')}: {why}")
    if bare and options.method != NAME:
        raise ScenarioError(f"--method {options.method} needs a payload; bare recordings give the ratios by {NAME}")
    return bare
