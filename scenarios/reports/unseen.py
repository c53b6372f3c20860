"""Report of the prediction of a motion that was not used in any fit."""

from pathlib import PurePath

import numpy as np

from ident.diagnosis.alternative import two_digits
from scenarios.reports.content import Column, Mood, Paragraph, Part, Table, cells, percent
from scenarios.reports.diagnoses import doubt_paragraphs
from scenarios.results.models.unseen import ResultUnseen

BARE = (
    "The motion is taken as bare. A factor common to all gains cancels, as the arm is identified with the same gains; "
    "a motion with a weighed payload (--unseen-payload) reveals it."
)
TOLD = (
    "Errors are norms, in % of the rms current of the joint; explained is the share of its squared currents. The arm, "
    "with viscous and Coulomb friction, is identified from the bare motions, each time with the gains in question. At "
    "most expected: three times the error of the fit on parts of its own motions that were left out, with the standard "
    "deviations of arm, gain and payload; no more than 15 %. A payload error below that may pass; rx90 verify tests it."
)


def unseen_verdict(
    found: ResultUnseen | None, *, this: str = "the identified gains", other: str = "the others"
) -> list[Part]:
    """Return a sentence on the prediction error; nothing without such a motion."""
    if found is None:
        return []
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
        listed = ", ".join(f"joint {each.joint} ({_digits(each.rel_error)} %)" for each in beyond)
        most = [each.largest_rel_error or 0.0 for each in beyond]
        less = " to ".join(dict.fromkeys(map(_digits, (min(most), max(most)))))
        why += (
            f". {log} is not predicted on {listed}, where at most {less} % is expected: its payload, unit or sign is "
            f"not as stated, or gains, arm model or friction are wrong for it"
        )
    if found.passed and found.verdict is None:
        return [Paragraph(f"Prediction error {errors} {said}.", strong=True)]
    mood, word = (Mood.GOOD, "PASSED") if found.passed else (Mood.BAD, "FAILED")
    return [Paragraph(f"{word}: prediction error {errors} {said}{why}.", mood, strong=True)]


def _digits(share: float | None) -> str:
    return two_digits(100.0 * (share or 0.0))


def unseen_parts(found: ResultUnseen | None, *, other: str = "others") -> list[Part]:
    """Return the table of prediction errors by joint; nothing without such a motion."""
    if found is None:
        return []
    columns = [Column(title="Joint"), Column(title="Prediction\nerror", unit="%"), Column(title="Explained", unit="%")]
    columns += [Column(title=f"Error,\n{other}", unit="%")] if found.verdict is not None else []
    columns += [Column(title="Residual\nof the fit", unit="%")] if found.fitted else []
    columns += [Column(title="At most\nexpected", unit="%")]
    rows = list[list[str]]()
    for each in found.joints:
        row = [str(each.joint), percent(each.rel_error, ".1f"), percent(each.explained, ".2f")]
        row += [percent(each.other_rel_error, ".1f")] if found.verdict is not None else []
        row += [percent(each.fitted_rel_error, ".1f")] if found.fitted else []
        rows.append([*row, percent(each.largest_rel_error, ".1f")])
    table = Table(
        title=f"Currents of {PurePath(found.log).name}, not used in any fit",
        columns=tuple(columns),
        rows=tuple(cells(*row) for row in rows),
    )
    notes = [Paragraph(TOLD)] if found.fitted else []
    notes += [Paragraph(BARE)] if not found.loaded else []
    return [table, *notes, *doubt_paragraphs(found.found)]
