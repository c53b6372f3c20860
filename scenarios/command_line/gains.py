"""Arguments for gains files: written by identifications, read by everything that uses gains."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.logs import log_description, read_unrepaired, robot_of
from scenarios.command_line.options import add_current_delay, policy_of
from scenarios.command_line.writing import right_to_write
from scenarios.results.write_access import Claim

if TYPE_CHECKING:
    from ident.diagnosis.diagnosis import Diagnosed
    from ident.estimation.known_gains import KnownGains
    from ident.model.arm import Arm
    from ident.parameters.payload import FoundPayload
    from ident.preparation import Prepared
    from scenarios.experiments.gains_file import GainsFile

ENDINGS = (".json", ".toml")


def gains_path(text: str) -> Path:
    """A file of gains, whose ending determines the format."""
    path = arguments.file(text)
    if path.suffix.lower() not in ENDINGS:
        raise argparse.ArgumentTypeError(
            f"{arguments.quoted(text)}: expected a file name that ends with {' or '.join(ENDINGS)}"
        )
    return path


def gains_or_numbers(text: str) -> Path | tuple[float, ...]:
    """A file of gains, or the gains of all joints, separated by commas."""
    if "," in text and Path(text).suffix.lower() not in ENDINGS:
        return tuple(map(arguments.number, text.split(",")))
    try:
        return gains_path(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, or numbers such as 12,12,10") from None


def add_compared_gains(parser: argparse.ArgumentParser, said: str) -> None:
    """Declare other gains; `said` is the help."""
    parser.add_argument("--compare-with", type=gains_or_numbers, metavar="G", help=said)


def known_gains(given: Path | tuple[float, ...], arm: "Arm") -> "KnownGains":
    """Return the gains of an arm, from a file or from numbers, which are taken as exact.

    Raises:
        ScenarioError: If the file is not valid.
        GainsError: If they are not of this arm.
    """
    from ident.estimation.known_gains import stated_gains
    from ident.support.errors import GainsError
    from scenarios.experiments.gains_file import read_gains

    if isinstance(given, Path):
        return read_gains(given).of(arm)
    if len(given) != arm.n:
        raise GainsError(f"--compare-with: {len(given)} gains, but robot {arm.name} has {arm.n} joints")
    return stated_gains(arm, given)


def add_gains_out(parser: argparse.ArgumentParser) -> None:
    """Declare --gains-out and --force."""
    said = "write the gains with covariance and origin, .toml or .json"
    parser.add_argument("--gains-out", type=gains_path, metavar="FILE", help=said)
    arguments.add_force_argument(parser)


def claimed(options: argparse.Namespace, command: str) -> Claim | None:
    """Return the permission to write the requested file, None if there is none.

    Raises:
        ScenarioError: If a file exists that the command did not write.
        OSError: If it cannot be written.
    """
    path: Path | None = options.gains_out
    return None if path is None else right_to_write(options, path.parent, [path.name], command=command)


def write(file: "GainsFile", held: Claim) -> None:
    """Write a gains file.

    Raises:
        OSError: If it cannot be written.
    """
    from scenarios.results.gains_file import gains_text

    path = held.folder / held.names[0]
    with held.writing():
        path.write_text(gains_text(file, path.suffix), encoding="utf-8")


def add_gains_argument(parser: argparse.ArgumentParser, *, needed: bool, said: str) -> None:
    """Declare the file of gains."""
    parser.add_argument("--gains", type=gains_path, required=needed, metavar="G", help=said)


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
    return [
        *options.observe,
        *([] if delay is None else [f"current_delay={0.0 if delay == arguments.AUTO else delay}"]),
    ]


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

    from ident.parameters.payload import payload_of
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
