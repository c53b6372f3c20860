"""Report of `rx90 verify` for two files of gains: which gains changed significantly, and whether by a common factor."""

from collections.abc import Callable

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.estimation.gain_comparison import GainComparison, Moved, Together
from scenarios.experiments.gains_file import TURNING, GainsFile
from scenarios.gains_in_use.results import gain_comparison_result
from scenarios.rendering.content import (
    Cell,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    column,
    joints_named,
    percent,
    table,
    two_sigma,
)
from scenarios.results.gains import common_unit, gain_units


def comparison_report(found: GainComparison, A: GainsFile, B: GainsFile) -> Report:
    """Return the report: every joint's change, the common factor, and two tests of all joints."""
    parts: list[Part] = [
        _conclusion(found),
        _changes(found, A, B),
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


def _changes(found: GainComparison, A: GainsFile, B: GainsFile) -> Table:
    """Return the table of gains, changes, and changes relative to the common factor (not for a single joint)."""
    unit = common_unit(gain_units([A.gains[joint].unit == TURNING for joint in found.joints]))
    apart = found.apart if len(found.joints) > 1 else (None,)

    def gain(file: GainsFile) -> Callable[[tuple[int, Moved, Moved | None]], str]:
        return lambda row: f"{file.gains[row[0]].estimate or 0.0:.4f}"

    return table(
        list(zip(found.joints.tolist(), found.each, apart, strict=True)),
        column("Joint", lambda row: row[0] + 1),
        column("Name", lambda row: str(A.gains[row[0]].name or B.gains[row[0]].name or row[0] + 1), words=True),
        column(f"A [{unit}]", gain(A)),
        column(f"B [{unit}]", gain(B)),
        column("Change [%]", lambda row: percent(row[1].rel, "+.2f")),
        column("2 sigma [%]", lambda row: two_sigma(row[1].rel_std)),
        column("Relative to\ncommon factor [%]", lambda row: percent(row[2] and row[2].rel, "+.2f")),
        column("2 sigma [%]", lambda row: two_sigma(row[2] and row[2].rel_std)),
        column("Verdict", lambda row: _verdict(row[1]), words=True),
    )


def _common(found: GainComparison) -> str:
    """Return the common factor and its joints."""
    scale, alone = found.scale, np.setdiff1d(found.joints, found.sharing).tolist()
    if len(found.joints) == 1:
        return f"Only joint {found.joints[0] + 1} has a gain in both files, so a common factor is unknown."
    if not len(found.sharing):
        return (
            "No change is common to more than half of the joints. Changes relative to the mean of all joints, "
            f"{100.0 * scale.rel:+.2f} %, do not show which joint's gain changed."
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
    """Return a warning if both were identified from the same recordings, as their errors are then correlated."""
    shared = sorted({each.name for each in A.recordings if each.sha256 in {other.sha256 for other in B.recordings}})
    if not shared:
        return []
    words = (
        f"WARNING: A and B share {', '.join(shared)}: their errors are correlated, so the intervals are not valid. "
        "Compare gains from separate recordings."
    )
    return [Paragraph(words, Mood.DOUBTFUL)]


def _size(change: Moved) -> str:
    return f"{two_digits(100.0 * change.rel, sign='+')} %, 2 sigma {two_digits(200.0 * change.rel_std)} %"


def _relative(found: GainComparison) -> list[tuple[int, Moved]]:
    """Return the joints, from 0, with their changes relative to a common factor, if there is one."""
    return list(zip(found.joints.tolist(), found.apart, strict=True)) if len(found.sharing) else []


def _conclusion(found: GainComparison) -> Paragraph:
    pairs = list(zip(found.joints.tolist(), found.each, strict=True))
    moved = [j + 1 for j, each in pairs if each.moved]
    worst, largest = max(pairs, key=lambda pair: (pair[1].turned, abs(pair[1].log) / pair[1].std))
    change = f"joint {worst + 1}, {_size(largest)}"
    if moved:
        words = f"{joints_named(moved)} changed significantly ({f'most: {change}' if moved[1:] else _size(largest)})"
        return Paragraph(f"MOVED: {words}.", Mood.BAD, strong=True)
    if found.moved:
        words = f"the gains changed significantly as a whole (p = {found.together.p:.2g}), no single one did"
        relative = [f"joint {j + 1}, {_size(each)}" for j, each in _relative(found) if each.moved]
        words += f"; relative to the common factor: {', '.join(relative)}" if relative else ""
        return Paragraph(f"MOVED: {words}.", Mood.BAD, strong=True)
    near = [j + 1 for j, each in pairs if each.beyond_two]
    limit = f"beyond 2, within {largest.limit:.2f} standard deviations: {joints_named(near)}" if near else ""
    words = f"no gain changed significantly (most: {change}{'; ' * bool(near)}{limit})"
    return Paragraph(f"SAME: {words}.", Mood.GOOD, strong=True)
