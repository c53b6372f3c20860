"""Prediction of a motion that was not used in any fit."""

from collections.abc import Sequence
from pathlib import PurePath

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.unseen import Unseen, UnseenJoint
from scenarios.rendering.content import NONE, Column, Mood, Paragraph, Part, Table, cells, percent
from scenarios.results.diagnoses import doubt_paragraphs

BARE = (
    "The motion is assumed to be bare. A factor common to all gains cancels, because the arm is identified with the "
    "same gains; a motion with a weighed payload (--unseen-payload) reveals it."
)
IDENTIFIED = (
    "The arm, with viscous and Coulomb friction, is identified from the bare motions, each time with the gains in "
    "question."
)
TOLD = (
    "Errors are norms, in % of the rms current of the joint; explained is the share of its squared currents. At most "
    "expected: three times the cross-validation error of the fit, combined with the standard deviations of arm, gain "
    "and payload; 15 % at most. Gain error by payload: error of the gain, with 2 sigma, if the payload is as "
    "specified; positive if the gain is too large. The test fails if this error exceeds both 15 % and 3 sigma; rx90 "
    "verify tests smaller errors."
)
DOUBTED = (
    "WARNING: according to the payload on this motion, gains are off by {}. Load-dependent friction and elastic "
    "joints, which are not modelled here, cause up to 11 % with correct gains; rx90 verify models both."
)


def unseen_verdict(
    found: Unseen | None,
    *,
    this: str = "the identified gains",
    other: str = "the others",
    passed: bool | None = None,
) -> list[Part]:
    """Return a sentence on the prediction error; nothing without such a motion.

    Args:
        found: The prediction.
        this: What predicts.
        other: What it is compared with.
        passed: Whether the prediction is good enough; None for better than the other.
    """
    if found is None:
        return []
    passed = found.passed if passed is None else passed
    log = PurePath(found.log).name
    said = f"of the currents of {log}, not used in any fit"
    fitted = [each.fitted_rel_error for each in found.joints if each.fitted_rel_error is not None]
    if fitted:
        said += f" (residual of the fit {_digits(float(np.sqrt(np.mean(np.square(fitted)))))} %)"
    errors = f"{_digits(found.rel_error)} %"
    if found.verdict is not None:
        errors += f" with {this}, {_digits(found.other_rel_error)} % with {other},"
    why = ": the difference is not significant" if found.verdict == "no different" else ""
    if why and not found.loaded and found.fitted:
        why += "; a motion with a weighed payload distinguishes gains better than a bare one"
    beyond = [each for each in found.joints if each.exceeds]
    if beyond:
        listed = ", ".join(f"joint {each.joint + 1} ({_digits(each.rel_error)} %)" for each in beyond)
        most = [each.largest_rel_error or 0.0 for each in beyond]
        less = " to ".join(dict.fromkeys(map(_digits, (min(most), max(most)))))
        why += (
            f". The prediction of {log} fails on {listed}; at most {less} % is expected. Its payload, unit or sign is "
            f"not as specified, or gains, arm model or friction are wrong"
        )
    wrong = [each for each in found.joints if each.misjudged]
    if wrong:
        why += f". By its payload the gains are off by {_gain_errors(wrong)}, or the payload is not as specified"
    doubted = [each for each in found.joints if each.doubted and not each.misjudged]
    doubt = [Paragraph(DOUBTED.format(_gain_errors(doubted)), Mood.DOUBTFUL, strong=True)] if doubted else []
    if passed and found.verdict is None:
        return [Paragraph(f"Prediction error {errors} {said}.", strong=True), *doubt]
    mood, word = (Mood.GOOD, "PASSED") if passed else (Mood.BAD, "FAILED")
    return [Paragraph(f"{word}: prediction error {errors} {said}{why}.", mood, strong=True), *doubt]


def _gain_errors(joints: Sequence[UnseenJoint]) -> str:
    """`+12 % (joint 1), -3.1 % (joint 3)`, how much each gain is too large."""
    return ", ".join(f"{_digits(each.gain_rel_error, sign='+')} % (joint {each.joint + 1})" for each in joints)


def _digits(share: float | None, *, sign: str = "") -> str:
    return two_digits(100.0 * (share or 0.0), sign=sign)


def unseen_parts(
    found: Unseen | None, *, other: str = "others", told: Sequence[str] = (IDENTIFIED, TOLD)
) -> list[Part]:
    """Return the table of prediction errors by joint; nothing without such a motion."""
    if found is None:
        return []
    columns = [Column(title="Joint"), Column(title="Prediction\nerror", unit="%"), Column(title="Explained", unit="%")]
    columns += [Column(title=f"Error,\n{other}", unit="%")] if found.verdict is not None else []
    columns += [Column(title="Residual\nof the fit", unit="%")] if found.fitted else []
    columns += [Column(title="At most\nexpected", unit="%")]
    partly = any(each.unstated_rel is not None for each in found.joints)
    columns += [Column(title="Not in\nthe copy", unit="%")] if partly else []
    weighed = any(each.gain_rel_error is not None for each in found.joints)
    columns += [Column(title="Gain error\nby payload", unit="%")] if weighed else []
    rows = list[list[str]]()
    for each in found.joints:
        row = [str(each.joint + 1), percent(each.rel_error, ".1f"), percent(each.explained, ".2f")]
        row += [percent(each.other_rel_error, ".1f")] if found.verdict is not None else []
        row += [percent(each.fitted_rel_error, ".1f")] if found.fitted else []
        row += [percent(each.largest_rel_error, ".1f")]
        row += [percent(each.unstated_rel, ".1f")] if partly else []
        rows.append([*row, *([_gain_error(each)] if weighed else [])])
    table = Table(
        title=f"Currents of {PurePath(found.log).name}, not used in any fit",
        columns=tuple(columns),
        rows=tuple(cells(*row) for row in rows),
    )
    notes = [Paragraph(text) for text in told]
    notes += [Paragraph(BARE)] if found.fitted and not found.loaded else []
    return [table, *notes, *doubt_paragraphs(found.found)]


def _gain_error(joint: UnseenJoint) -> str:
    """`+9.8 ± 0.6`, with two standard deviations."""
    if joint.gain_rel_error is None or joint.gain_rel_std is None:
        return NONE
    return f"{100.0 * joint.gain_rel_error:+z.1f} ± {200.0 * joint.gain_rel_std:.1f}"
