"""The problem of a payload with given gains: recordings are checked and observed with the options of the gains file."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TypeVar

import numpy as np
from pydantic import JsonValue

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed
from ident.diagnosis.link_masses import OTHER_UNIT
from ident.estimation.estimators import nls
from ident.estimation.estimators.nls import AllJointsOptions
from ident.estimation.gain_options import GainOptions
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.parameters.weighing import PLAIN, UNKNOWN
from ident.preparation import DOUBTED, Policy, Prepared, joined, prepare, raise_for
from ident.recordings.recording import Motion, Recording
from ident.support.errors import OptionError
from ident.support.naming import one_line
from ident.support.options import options_from_table, table_from_words
from scenarios.experiments.gains_file import GainsFile, RecordingEntry
from scenarios.results.gains_file import recording_digest
from scenarios.support.errors import ScenarioError

Options = TypeVar("Options")

GIVEN = ("gain_joint", "gain_value")
"""Options that define the common factor of gains; not applicable with given gains."""


def weighing_problem(
    structure: Structure,
    unloaded: Sequence[Recording],
    loaded: Sequence[Recording],
    file: GainsFile,
    observing: ObserveOptions,
    *,
    policy: Policy = DOUBTED,
) -> tuple[Prepared, Diagnosed]:
    """Prepare bare motions and motions with an unknown payload.

    Args:
        structure: Identifiable structure of the arm.
        unloaded: Bare motions.
        loaded: Motions of one mounting.
        file: The gains.
        observing: Filters and thresholds.
        policy: Policy for checks and repairs of the recordings.

    Returns:
        The prepared recordings and their diagnoses.

    Raises:
        IdentificationError: If recordings are not of this arm, or have a fault.
        ScenarioError: If the options of the file are not valid.
    """
    motions = [Motion(each) for each in unloaded] + [Motion(each, UNKNOWN) for each in loaded]
    gains = options_of(GainOptions, file.options.gains, ())
    prepared = prepare(motions, structure, observing=observing, gains=gains, policy=policy)
    found = diagnose(prepared.logs())
    raise_for(prepared, found)
    return prepared, joined(found, more=prepared.diagnoses)


def observe_options(file: GainsFile, words: Sequence[str]) -> ObserveOptions:
    """Return the filters of the gains file, modified by words `KEY=VALUE`.

    Raises:
        ScenarioError: If the options of the file are not valid.
        OptionError: If a word is not valid.
    """
    return options_of(ObserveOptions, file.options.observe, words)


def model_options(file: GainsFile, words: Sequence[str]) -> AllJointsOptions:
    """Return the model options of the gains file, modified by words `KEY=VALUE`.

    Raises:
        ScenarioError: If the options of the file are not valid.
        OptionError: If a word is not valid.
    """
    own = file.method in (None, nls.NAME)
    listed = file.options.method if own else asdict(PLAIN)
    stated = {name: value for name, value in listed.items() if name not in GIVEN}
    return options_of(AllJointsOptions, stated, words)


def options_of(kind: type[Options], stated: Mapping[str, JsonValue], words: Sequence[str]) -> Options:
    """Return options of a gains file, modified by words `KEY=VALUE`.

    Raises:
        ScenarioError: If the options of the file are not valid.
        OptionError: If a word is not valid.
    """
    try:
        options_from_table(kind, stated)
    except OptionError as error:
        raise ScenarioError(f"gains file: options: {error}") from error
    return options_from_table(kind, {**stated, **table_from_words(kind, words)})


def check_unseen(file: GainsFile, unloaded: Sequence[Recording], loaded: Sequence[Recording]) -> None:
    """Check that no loaded motion was used for the gains, and that no bare motion was loaded then.

    A loaded one, or a part of it, would reproduce the specified mass.

    Raises:
        ScenarioError: If one was.
    """
    carried = [each for each in file.recordings if each.payload is not None]
    for recording in unloaded:
        seen = _seen(carried, recording)
        if seen is not None:
            raise ScenarioError(
                f"{one_line(recording.name)}: given as bare, but it was loaded when the gains were identified "
                f"({seen.name}); are bare and loaded swapped?"
            )
    for recording in loaded:
        seen = _seen(file.recordings, recording)
        if seen is not None:
            raise ScenarioError(
                f"{one_line(recording.name)}: the gains were identified from this recording "
                f"({seen.name}), so they reproduce the payload that was specified then; use a recording with another "
                "payload"
            )


def check_currents(file: GainsFile, recording: Recording) -> None:
    """Check that currents are not in a smaller unit than those from which the gains were identified.

    Currents in a larger unit look like those of an arm at rest.

    Raises:
        ScenarioError: If the largest currents of all joints are larger than then by more than a factor of units.
    """
    then = [each.largest for each in file.recordings if len(each.largest) == recording.n]
    if not then:
        return  # of other joints, or of a file that does not say
    now, before = np.abs(recording.v).max(axis=0), np.max(then, axis=0)
    if before.all() and (now > OTHER_UNIT * before).all():
        j = int(np.argmin(now / before))
        raise ScenarioError(
            f"{one_line(recording.name)}: v{j + 1} reaches {now[j]:.3g}, but {before[j]:.3g} when the gains were "
            "identified, and likewise all joints; are the currents in another unit? --columns states it, as in 'v=[mA]'"
        )


def _seen(entries: Sequence[RecordingEntry], recording: Recording) -> RecordingEntry | None:
    """Return the entry with the samples of a recording; None if there is none."""
    digest = recording_digest(recording)
    return next((each for each in entries if each.sha256 == digest), None)
