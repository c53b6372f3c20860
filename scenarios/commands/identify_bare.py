"""`rx90 identify` of bare recordings alone."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ident.recordings.recording import Motion
from scenarios.rendering.content import Report
from scenarios.results.write_access import Claim
from scenarios.support.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.experiments.robots import NamedRobot


def wanted(options: argparse.Namespace, *, loaded: bool) -> bool:
    """Return whether only ratios of gains are identifiable: no payload, and no option states a gain.

    Raises:
        ScenarioError: If an option is not applicable to the recordings.
    """
    bare = not loaded and not any("gain" in word.partition("=")[0] for word in options.option)
    if not bare and options.gains is not None:
        raise ScenarioError("--gains: for bare recordings only; loaded recordings identify the gains, so remove it")
    if not bare and options.if_loaded is not None:
        raise ScenarioError("--if-loaded: for bare recordings only; loaded recordings identify the gains, so remove it")
    if bare and options.compare_with is not None:
        raise ScenarioError(
            "--compare-with: bare recordings have no payload to estimate; add "
            "--loaded B --payload P.toml, or use --gains G"
        )
    if bare and options.unseen is not None:
        raise ScenarioError("--unseen: bare recordings give no gains to predict with; add --loaded B --payload P.toml")
    if bare and options.gains_out is not None:
        raise ScenarioError("--gains-out: bare recordings give only ratios of gains; add --loaded B --payload P.toml")
    if options.if_loaded is not None and options.gains is None:
        raise ScenarioError(
            "--if-loaded: the forecast needs approximate gains; add --gains G, for example from a data sheet"
        )
    return bare


def found(options: argparse.Namespace, robot: "NamedRobot", motions: Sequence[Motion], saving: Claim | None) -> Report:
    """Identify ratios, base parameters and friction, and save them on request.

    Raises:
        IdentificationError: If the recordings are not of this arm, or determine no ratio.
        OptionError: If the method is not `nls`.
    """
    from ident.estimation.estimators.nls import NAME, AllJointsOptions
    from ident.estimation.gain_options import GainOptions
    from ident.observation.observation import ObserveOptions
    from ident.payload.payload import read_payload
    from ident.support.options import options_from_words
    from scenarios.command_line.gains import known_gains
    from scenarios.command_line.options import chosen, policy_of
    from scenarios.gains_in_use.bare import bare_answer, bare_result
    from scenarios.gains_in_use.model_values import known_links

    if options.method != NAME:
        raise ScenarioError(
            f"--method {options.method} needs a payload; with bare recordings only, {NAME} gives the ratios"
        )
    payload = None if options.if_loaded is None else read_payload(options.if_loaded)
    observing, limits = chosen(ObserveOptions, options), chosen(GainOptions, options)
    own = options_from_words(AllJointsOptions, options.option)
    answer = bare_answer(
        motions,
        robot.structure,
        observing=observing,
        gains=limits,
        options=own,
        known=None if options.gains is None else known_gains(options.gains, robot.structure.arm),
        payload=payload,
        policy=policy_of(options),
    )
    links = known_links(answer.in_si, robot.structure, robot.model, robot.flange)
    arm = robot.structure.arm
    result = bare_result(answer, links, arm)
    if saving is not None:
        from scenarios.results.record import save_result

        with saving.writing():
            save_result(
                saving.folder,
                result,
                kind="bare",
                title=f"Bare motions of {arm.name}",
                command=options.command_line,
                model=robot.model,
                flange=robot.flange,
                arm=robot.structure.arm,
                motions=motions,
                observing=answer.observing,
                gains=limits,
                method=options.method,
                options=own,
                payload=payload,
                believed=options.gains,
            )
    return result.report(f"Bare motions of {arm.name}")
