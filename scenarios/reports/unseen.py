"""A motion that no fit has seen, in words: how far off each joint's currents are predicted, beside other gains."""

from pathlib import PurePath

import numpy as np

from scenarios.reports.content import Column, Mood, Paragraph, Part, Table, cells, percent
from scenarios.reports.diagnoses import doubt_paragraphs
from scenarios.results.models.unseen import ResultUnseen

BARE = (
    "The motion counts as bare. A factor common to all gains cancels there, as the arm is found with the same gains: "
    "a motion with a weighed payload (--unseen-payload) shows it."
)
TOLD = (
    "Errors are norms, in % of the rms current of the joint; explained is the share of its squared currents. The arm "
    "is that of the bare motions with viscous and Coulomb friction, each time with the gains in question."
)


def unseen_verdict(
    found: ResultUnseen | None, *, this: str = "the gains found", other: str = "the others"
) -> list[Part]:
    """How far off the motion is predicted, in a sentence; nothing where there is none.

    Args:
        found: The prediction.
        this: What predicts it.
        other: What this is held against.
    """
    if found is None:
        return []
    log = PurePath(found.log).name
    said = f"of the currents of {log}, which no fit has seen"
    fitted = [each.fitted_rel_error for each in found.joints if each.fitted_rel_error is not None]
    if fitted:
        said += f" (residual of the fit {percent(float(np.sqrt(np.mean(np.square(fitted)))), '.2g')} %)"
    if found.verdict is None:
        return [Paragraph(f"Prediction error {percent(found.rel_error, '.2g')} % {said}.", strong=True)]
    errors = f"{percent(found.rel_error, '.2g')} % with {this}, {percent(found.other_rel_error, '.2g')} % with {other}"
    mood, word = (Mood.GOOD, "PASSED") if found.passed else (Mood.BAD, "FAILED")
    why = "" if found.verdict != "no different" else ": the difference is no more than chance"
    if why and not found.loaded and found.fitted:
        why += "; a bare motion hardly tells gains apart, one with a weighed payload does"
    return [Paragraph(f"{word}: prediction error {errors}, {said}{why}.", mood, strong=True)]


def unseen_parts(found: ResultUnseen | None, *, other: str = "others") -> list[Part]:
    """The motion joint by joint; nothing where there is none.

    Args:
        found: The prediction.
        other: What it is held against, in a word or two.
    """
    if found is None:
        return []
    columns = [Column(title="Joint"), Column(title="Prediction\nerror", unit="%"), Column(title="Explained", unit="%")]
    columns += [Column(title=f"Error,\n{other}", unit="%")] if found.verdict is not None else []
    columns += [Column(title="Residual\nof the fit", unit="%")] if found.fitted else []
    rows = list[list[str]]()
    for each in found.joints:
        row = [str(each.joint), percent(each.rel_error, ".1f"), percent(each.explained, ".2f")]
        row += [percent(each.other_rel_error, ".1f")] if found.verdict is not None else []
        rows.append([*row, *([percent(each.fitted_rel_error, ".1f")] if found.fitted else [])])
    table = Table(
        title=f"Currents of {PurePath(found.log).name}, which no fit has seen",
        columns=tuple(columns),
        rows=tuple(cells(*row) for row in rows),
    )
    notes = [Paragraph(TOLD)] if found.fitted else []
    notes += [Paragraph(BARE)] if not found.loaded else []
    return [table, *notes, *doubt_paragraphs(found.found)]
