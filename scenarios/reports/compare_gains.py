"""What `rx90 compare-gains` says: which gains moved beyond their interval, and whether all by one scale."""

from collections.abc import Sequence

import numpy as np

from ident.estimation.gain_comparison import GainComparison, Moved, Together
from scenarios.experiments.files.gains import TURNING, GainsFile
from scenarios.gains_in_use.results import gain_comparison_result
from scenarios.reports.content import VERDICT, Cell, Column, Mood, Paragraph, Part, Report, Table, cells, percent
from scenarios.reports.gains import gain_unit, joints_named

COLUMNS = (
    Column(title="Change", unit="%"),
    Column(title="2 sigma", unit="%"),
    Column(title="Relative to\ncommon scale", unit="%"),
    Column(title="2 sigma", unit="%"),
    VERDICT,
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
        for joint, each, apart in zip(found.joints.tolist(), found.each, _relative(found), strict=True)
    )
    parts: list[Part] = [
        _conclusion(found),
        Table(columns=(*_gain_columns(found, A), *COLUMNS), rows=rows),
        Paragraph(_common(found)),
        Paragraph(
            f"A verdict is MOVED beyond {found.each[0].limit:.2f} standard deviations of log(B/A) "
            f"(5 % false alarms{' for all joints together' if len(found.joints) > 1 else ''}). Changes and 2 sigma "
            "are in % of A."
        ),
        Paragraph(_test("Test of no change", found.together)),
    ]
    if found.pattern is not None:
        parts.append(Paragraph(_test("Test of one change common to all joints", found.pattern)))
    parts += [Paragraph(f"Joint {j + 1} has a gain in {which} only.") for j, which in found.missing]
    parts += _same_data(A, B)
    return Report("Gains A against B", tuple(parts), gain_comparison_result(found).model_dump(mode="json"))


def _gain_columns(found: GainComparison, A: GainsFile) -> tuple[Column, ...]:
    unit = gain_unit(np.array([A.gains[joint].unit == TURNING for joint in found.joints]))
    joint, name = Column(title="Joint"), Column(title="Name", words=True)
    return joint, name, Column(title="A", unit=unit), Column(title="B", unit=unit)


def _relative(found: GainComparison) -> Sequence[Moved | None]:
    """Changes relative to the common scale; a single joint has none."""
    return found.apart if len(found.joints) > 1 else (None,)


def _numbers(each: Moved, apart: Moved | None) -> Sequence[tuple[float | None, str]]:
    rel, std = (None, None) if apart is None else (apart.rel, 2.0 * apart.rel_std)
    return (each.rel, "+.2f"), (2.0 * each.rel_std, ".2f"), (rel, "+.2f"), (std, ".2f")


def _common(found: GainComparison) -> str:
    """The scale, and whose it is."""
    scale, alone = found.scale, np.setdiff1d(found.joints, found.sharing).tolist()
    if len(found.joints) == 1:
        return f"Only joint {found.joints[0] + 1} has a gain in both files, so a scale common to all joints is unknown."
    if not len(found.sharing):
        return (
            "No change is common to more than half of the joints. Changes relative to the mean of all joints, "
            f"{100.0 * scale.rel:+.2f} %, do not show which joint moved."
        )
    whose = f"all joints but {', '.join(str(j + 1) for j in alone)}" if alone else "all joints"
    return (
        f"Change common to {whose}: {100.0 * scale.rel:+.2f} %, 2 sigma {200.0 * scale.rel_std:.2f} %"
        f"{'; significant, check the payload masses and current units of A and B' if scale.moved else ''}."
    )


def _verdict(each: Moved) -> Cell:
    if each.turned:
        return Cell("TURNED", Mood.BAD)
    return Cell("MOVED", Mood.BAD) if each.moved else Cell("same", Mood.GOOD)


def _test(what: str, test: Together) -> str:
    return f"{what}: chi2 = {test.chi2:.3g}, degrees of freedom = {test.freedom}, p = {test.p:.2g}."


def _same_data(A: GainsFile, B: GainsFile) -> list[Part]:
    """A note if both were found from the same recordings: their errors are then not independent."""
    shared = sorted({each.name for each in A.recordings if each.sha256 in {other.sha256 for other in B.recordings}})
    if not shared:
        return []
    words = (
        f"WARNING: A and B share {', '.join(shared)}: their errors are correlated, so the intervals are not valid. "
        "Compare gains from separate recordings."
    )
    return [Paragraph(words, Mood.DOUBTFUL)]


def _conclusion(found: GainComparison) -> Paragraph:
    pairs = list(zip(found.joints.tolist(), found.each, strict=True))
    moved = [j + 1 for j, each in pairs if each.moved]
    worst, largest = max(pairs, key=lambda pair: (pair[1].turned, abs(pair[1].log) / pair[1].std))
    change = f"joint {worst + 1}, {100.0 * largest.rel:+.2g} %, 2 sigma {200.0 * largest.rel_std:.2g} %"
    if moved:
        words = f"{joints_named(moved)} changed significantly ({'most: ' if moved[1:] else ''}{change})"
        return Paragraph(f"MOVED: {words}.", Mood.BAD, strong=True)
    if found.moved:
        words = f"the gains changed significantly as a whole (p = {found.together.p:.2g}), no single one did"
        return Paragraph(f"MOVED: {words}.", Mood.BAD, strong=True)
    near = [j + 1 for j, each in pairs if each.beyond_two]
    limit = f"beyond 2, within {largest.limit:.2f} standard deviations: {joints_named(near)}" if near else ""
    words = f"no gain changed significantly (most: {change}{'; ' * bool(near)}{limit})"
    return Paragraph(f"SAME: {words}.", Mood.GOOD, strong=True)
