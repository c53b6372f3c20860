"""What was identified or checked, saved as a folder: the argument, the right to write there, the writing."""

import argparse
from typing import TYPE_CHECKING

import scenarios.command_line.arguments as arguments
from scenarios.command_line.writing import right_to_write
from scenarios.results.write_access import Claim

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from ident.estimation.gain_options import GainOptions
    from ident.identification import Identification
    from ident.observation.observation import ObserveOptions
    from ident.payload.payload import Payload
    from ident.recordings.motion import Motion
    from scenarios.reports.content import Report
    from scenarios.results.log_folder import Done
    from scenarios.results.record import Kind


def add_save_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the folder."""
    parser.add_argument(
        "--save",
        type=arguments.folder,
        metavar="DIR",
        help="folder for recordings, payloads, options and result, for `rx90 report DIR`",
    )


def claimed_folder(options: argparse.Namespace, motions: int, command: str) -> Claim | None:
    """The right to write the folder that is asked for, None if none is.

    Args:
        options: Parsed.
        motions: Recordings that will be written.
        command: That writes them.

    Raises:
        ScenarioError: If a file is there that the command did not write.
        OSError: If it cannot be written.
    """
    if options.save is None:
        return None
    from scenarios.results.log_folder import log_files

    return right_to_write(options, options.save, log_files(motions), command=command)


def save(done: "Done", held: Claim) -> None:
    """Write the folder.

    Raises:
        OSError: If it cannot be written.
    """
    from scenarios.results.log_folder import save_logs

    with held.writing():
        save_logs(done, held.folder)


def save_identified(
    options: argparse.Namespace,
    held: Claim | None,
    report: "Report",
    *,
    kind: "Kind",
    title: str,
    motions: "Sequence[Motion]",
    observing: "ObserveOptions",
    gains: "GainOptions",
    own: object,
    payload: "Payload | None" = None,
    believed: "Path | None" = None,
    found: "Identification | None" = None,
) -> None:
    """Write the folder of an identification, if one is asked for.

    Args:
        options: Parsed; they name command, model and method.
        held: The right to write it, None if nobody asks for it.
        report: What was found.
        kind: Whether gains were found, or what bare motions say.
        title: Of its page.
        motions: Recordings and payloads, in the order they were taken.
        observing: Filters and thresholds.
        gains: When a gain counts as identifiable.
        own: The method's own options.
        payload: That would be mounted on a bare flange.
        believed: File of gains that were given with bare motions.
        found: The gains, where they were found.

    Raises:
        OSError: If it cannot be written.
    """
    if held is None:
        return
    from scenarios.results.fit_rows import fit_of
    from scenarios.results.log_folder import Done

    prepared = None if found is None else found.prepared
    done = Done(
        kind=kind,
        title=title,
        command=options.command_line,
        model=options.model,
        flange=options.flange,
        couplings=options.coupling,
        motions=motions,
        observing=observing,
        gains=gains,
        document=report.document,
        method=options.method,
        options=own,
        payload=payload,
        believed=believed,
        fit=None if found is None or prepared is None else fit_of(prepared, found.estimate),
    )
    save(done, held)
