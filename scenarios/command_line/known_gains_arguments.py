"""Common arguments of commands that estimate payloads with known gains."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.command_line import gains_file_arguments
from scenarios.command_line.arguments import AUTO
from scenarios.command_line.log_arguments import log_description, read_unrepaired
from scenarios.command_line.options import add_current_delay, policy_of
from scenarios.command_line.robot_arguments import robot_of

if TYPE_CHECKING:
    from ident.diagnosis.diagnosis import Diagnosed
    from ident.payload_identification.payload_estimate import FoundPayload
    from ident.preparation import Prepared
    from scenarios.experiments.files.gains import GainsFile


def add_gains_argument(parser: argparse.ArgumentParser, *, needed: bool, said: str) -> None:
    """Declare the file of gains."""
    parser.add_argument("--gains", type=gains_file_arguments.gains_path, required=needed, metavar="G", help=said)


def add_overlay_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare options that replace those of the gains file."""
    for name, what in (("--option", "of nls"), ("--observe", "of filtering and decimation")):
        parser.add_argument(
            name,
            action="append",
            default=[],
            metavar="KEY=VALUE",
            help=f"an option {what} that replaces the one used for the gains; repeatable",
        )
    add_current_delay(parser)


def observe_words(options: argparse.Namespace) -> list[str]:
    """Return options of filters and decimation as words `KEY=VALUE`, without a delay to be estimated."""
    delay = options.current_delay
    return [*options.observe, *([] if delay is None else [f"current_delay={0.0 if delay == AUTO else delay}"])]


def weigh(
    options: argparse.Namespace, file: "GainsFile", unloaded: Sequence[Path], loaded: Sequence[Path]
) -> "tuple[FoundPayload, Diagnosed, Prepared]":
    """Read recordings and estimate their payload with the gains of a file.

    Returns:
        The payload, diagnoses, and the recordings as used.

    Raises:
        ScenarioError: If a loaded recording was used for the gains, or a bare one was loaded then.
        IdentificationError: If the payload is not identifiable.
    """
    from threadpoolctl import threadpool_limits

    from ident.payload_identification.payload_estimate import payload_of
    from scenarios.gains_in_use.known_gains_problem import (
        check_unseen,
        model_options,
        observe_options,
        weighing_problem,
    )

    with threadpool_limits(1):  # small matrices gain nothing from a threaded BLAS, and stall now and then
        arm = robot_of(options, options.model).structure
        known, said = file.of(arm.arm), log_description(options, arm.arm.joint_names)
        bare, heavy = (read_unrepaired(each, said) for each in (unloaded, loaded))
        check_unseen(file, bare, heavy)
        observing = observe_options(file, observe_words(options))
        prepared, diagnosed = weighing_problem(arm, bare, heavy, file, observing, policy=policy_of(options))
        return payload_of(prepared.problem, known, model_options(file, options.option)), diagnosed, prepared
