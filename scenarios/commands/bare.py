"""`rx90 identify` of bare recordings alone."""

import argparse
from collections.abc import Sequence

from ident.identification import Recorded
from ident.structure import Structure
from scenarios.errors import WrongFiles
from scenarios.reports.content import Report


def wanted(options: argparse.Namespace, *, loaded: bool) -> bool:
    """Whether ratios of gains are what the recordings give: none carries a payload, and no option gives a gain.

    Args:
        options: Of the command line.
        loaded: Whether a recording carries a payload.

    Raises:
        WrongFiles: If something is asked for that goes with the other kind of recordings alone.
    """
    bare = not loaded and not any("gain" in word.partition("=")[0] for word in options.option)
    if not bare and options.gains is not None:
        raise WrongFiles("--gains goes with bare recordings alone; with a payload the gains are found, not given")
    if bare and options.gains_out is not None:
        raise WrongFiles("--gains-out: bare recordings give ratios of gains alone; add --loaded B --payload P.toml")
    if bare and options.save is not None:
        raise WrongFiles("--save: bare recordings give ratios of gains alone; add --loaded B --payload P.toml")
    return bare


def found(options: argparse.Namespace, structure: Structure, motions: Sequence[Recorded]) -> Report:
    """Ratios, base parameters and friction.

    Raises:
        IdentificationError: If the recordings cannot be those of this arm, or show no ratio.
        OptionError: If the method is not `nls`.
    """
    from ident.bare import arm_in_SI, gain_ratios, off_ratios
    from ident.cross_validation import predicted
    from ident.estimators.nls import NAME, AllJointsOptions
    from ident.observation import ObserveOptions, observe
    from ident.options import GainOptions, options_from_words
    from ident.plausibility import check_different, check_positions
    from ident.problem import Motion, Problem
    from scenarios.commands.options import chosen
    from scenarios.files.gains import read_gains
    from scenarios.reports.bare import bare_report

    if options.method != NAME:
        raise WrongFiles(f"--method {options.method} needs a payload; of bare recordings alone {NAME} gives the ratios")
    for each in motions:
        check_positions(structure.arm, each.recording)
    check_different([each.recording for each in motions])
    observing = chosen(ObserveOptions, options)
    observed = tuple(Motion(observe(each.recording, structure, observing), None) for each in motions)
    problem, own = (
        Problem(structure, observed, chosen(GainOptions, options)),
        options_from_words(AllJointsOptions, options.option),
    )
    ratios, off, in_si = gain_ratios(problem, own), (), None
    if options.gains is not None:
        known = read_gains(options.gains).known
        in_si = arm_in_SI(problem, own, known)
        assert ratios.ratios is not None, "ratios were asked for"
        off = off_ratios(ratios.ratios, known)
    return bare_report(ratios, predicted(ratios.selected.final.fit.rows), off, in_si, structure.arm)
