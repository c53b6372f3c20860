"""What `rx90 compare-gains` says: which gains moved beyond their interval, and whether all by one scale."""

from collections.abc import Sequence

import numpy as np

from ident.estimation.gain_comparison import GainComparison, Moved, Together
from scenarios.experiments.files.gains import TURNING, GainsFile
from scenarios.gains_in_use.results import gain_comparison_result
from scenarios.reports.content import Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.gains import gain_unit

COLUMNS = (
    Column(title="Moved", unit="%"),
    Column(title="2 sigma", unit="%"),
    Column(title="beside the scale", unit="%"),
    Column(title="2 sigma", unit="%"),
    Column(title="Verdict", words=True),
)
"""Those after the gains."""


def comparison_report(found: GainComparison, A: GainsFile, B: GainsFile) -> Report:
    """Every joint's change, the one they have in common, and two tests of all together."""
    rows = tuple(
        cells(
            str(joint + 1),
            A.gains[joint].name or B.gains[joint].name or str(joint + 1),
            f"{A.gains[joint].estimate or 0.0:.4f}",
            f"{B.gains[joint].estimate or 0.0:.4f}",
            *(percent(number, form) for number, form in _numbers(each, apart)),
            _verdict(each),
        )
        for joint, each, apart in zip(found.joints.tolist(), found.each, found.apart, strict=True)
    )
    parts: list[Part] = [
        Table(columns=(*_gain_columns(found, A), *COLUMNS), rows=rows),
        Paragraph(_common(found)),
        Paragraph(
            f"A verdict is MOVED beyond {found.each[0].limit:.2f} deviations of the logarithm of the "
            "change, a false alarm rate of 5 % for all joints together. Changes and 2 sigma are in % of "
            "A."
        ),
        Paragraph(_test("All joints together", found.together)),
    ]
    if found.pattern is not None:
        parts.append(Paragraph(_test("Relative to a common scale", found.pattern)))
    parts += [Paragraph(f"Joint {j + 1} has a gain in {which} only.") for j, which in found.missing]
    parts += _same_data(A, B)
    parts.append(_conclusion(found))
    return Report("Gains A against B", tuple(parts), gain_comparison_result(found).model_dump(mode="json"))


def _gain_columns(found: GainComparison, A: GainsFile) -> tuple[Column, ...]:
    unit = gain_unit(np.array([A.gains[joint].unit == TURNING for joint in found.joints]))
    joint, name = Column(title="Joint"), Column(title="Name", words=True)
    return joint, name, Column(title="A", unit=unit), Column(title="B", unit=unit)


def _numbers(each: Moved, apart: Moved) -> Sequence[tuple[float, str]]:
    return (each.rel, "+.2f"), (2.0 * each.rel_std, ".2f"), (apart.rel, "+.2f"), (2.0 * apart.rel_std, ".2f")


def _common(found: GainComparison) -> str:
    """The scale, and whose it is."""
    scale, alone = found.scale, np.setdiff1d(found.joints, found.sharing).tolist()
    if not len(found.sharing):
        return (
            "No scale is common to more than half of the joints; relative to that of all, "
            f"{100.0 * scale.rel:+.2f} %, no change shows which joint moved."
        )
    whose = f"all joints but {', '.join(str(j + 1) for j in alone)}" if alone else "all joints"
    return (
        f"Common to {whose}: {100.0 * scale.rel:+.2f} %, 2 sigma {200.0 * scale.rel_std:.2f} %"
        f"{', beyond its interval: a payload weighed or a unit scaled otherwise' if scale.moved else ''}."
    )


def _verdict(each: Moved) -> Cell:
    if each.turned:
        return Cell("TURNED", Mood.BAD)
    return Cell("MOVED", Mood.BAD) if each.moved else Cell("same", Mood.GOOD)


def _test(what: str, test: Together) -> str:
    return f"{what}: chi2 {test.chi2:.3g} of {test.freedom} degrees of freedom, p = {test.p:.2g}."


def _same_data(A: GainsFile, B: GainsFile) -> list[Part]:
    """A note if both were found from the same recordings: their errors are then not independent."""
    shared = sorted({each.name for each in A.recordings if each.sha256 in {other.sha256 for other in B.recordings}})
    if not shared:
        return []
    words = (
        f"Note: both are from {', '.join(shared)}: their errors are correlated, so intervals are too wide "
        "or too narrow."
    )
    return [Paragraph(words, Mood.DOUBTFUL)]


def _conclusion(found: GainComparison) -> Paragraph:
    moved = [str(j + 1) for j, each in zip(found.joints.tolist(), found.each, strict=True) if each.moved]
    if moved:
        return Paragraph(f"MOVED: joint {', '.join(moved)} beyond the interval.", Mood.BAD, strong=True)
    if found.moved:
        return Paragraph("MOVED: all joints together, but no single joint.", Mood.BAD, strong=True)
    near = [str(j + 1) for j, each in zip(found.joints.tolist(), found.each, strict=True) if each.beyond_two]
    words = f", joint {', '.join(near)} beyond 2 sigma, as expected of one joint in several" if near else ""
    return Paragraph(f"SAME: no gain moved beyond its interval{words}.", Mood.GOOD, strong=True)
