"""The page of what a diagnosis says of sound and of faulty logs."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from diagnosis_cases import APART, SET, SoundCase
from diagnosis_fault import Fault
from diagnosis_judged import REMARKS, RULES, Cost, Judged, Verdict, accusations, sigmas
from diagnosis_run import Run
from scipy import stats

from ident.diagnosis.candidates import SHOWN, TIE, WORTH
from ident.diagnosis.catalog.zeros import LARGEST
from ident.diagnosis.comparison import BLOCKS
from ident.diagnosis.diagnosis import MATTERS, SPOILS
from scenarios.rendering.content import Cell, Column, Heading, Paragraph, Part, Report, Table, cells

TILTED = "base tilt 2 mrad"
"""A condition whose base is tilted: to say so is right."""


@dataclass(frozen=True, slots=True, eq=False)
class Sound:
    """A sound case and what was said of it."""

    case: SoundCase
    run: Run

    @property
    def wrong(self) -> list[str]:
        """Names that accuse."""
        allowed = {"base"} if self.case.condition == TILTED else set[str]()
        return [each.name for each in accusations(self.run) if each.name not in allowed]

    @property
    def accused(self) -> bool:
        """Whether a mistake is named that nobody made."""
        return bool(self.wrong)

    @property
    def refused(self) -> bool:
        """Whether an error or a diagnosis refuses a gain of it."""
        return self.run.error is not None or any(each.severity == "wrong" for each in self.run.said)


@dataclass(frozen=True, slots=True, eq=False)
class Faulty:
    """A fault, what was said of it, and the judgement of that."""

    case: SoundCase
    fault: Fault
    run: Run
    judged: Judged


def page(sound: Sequence[Sound], faulty: Sequence[Faulty]) -> Report:
    """All of it."""
    parts: list[Part] = [Paragraph(summary(sound, faulty))]
    parts += [Heading("Fault-free logs"), Paragraph(ABOUT_SOUND)]
    parts += [sound_table(sound, "Arm", lambda each: each.case.arm)]
    parts += [sound_table(sound, "Condition", lambda each: each.case.condition)]
    parts += [Heading("False alarms in fault-free logs"), wrong_table(sound)]
    parts += [Heading("Faults"), Paragraph(ABOUT_FAULTS), power_table(faulty)]
    parts += [Heading("By size"), size_table(faulty)]
    parts += [Heading("Misidentified faults"), Paragraph(ABOUT_CONFUSED), confusion_table(faulty)]
    parts += [Heading("Undetected harmful faults"), Paragraph(ABOUT_SILENT), silent_table(faulty)]
    parts += [Heading("Constants"), constants()]
    return Report("Detection rates of the diagnosis", tuple(parts), {})


ABOUT_SOUND = (
    "Logs of two simulators under difficult conditions, and real logs; half of the arms were not used to set "
    "constants. A false alarm is a diagnosis of a fault in a log, the payload or the model's geometry; effects that "
    "the model lacks (elasticity, a law of friction) are not counted. Refused: a gain, or all. Off: gains further from "
    "the truth than three estimated standard deviations, of all gains given."
)
ABOUT_FAULTS = (
    "One fault at a time in fault-free logs under ordinary conditions. Named: the injected fault with its joints and "
    "logs and its size within 20 % or three standard deviations, or a fault that the kinematics cannot distinguish "
    "from it, or one that the diagnosis lists as indistinguishable. A fault that is not named is harmless if no gain "
    "changes by more than one estimated standard deviation, harmful beyond three. Unseen: without noise the fault "
    "leaves no residual, so no log can show it."
)
ABOUT_CONFUSED = "Rows: the injected fault. Columns: the fault that was named instead."
ABOUT_SILENT = (
    "Faults that were not named, at most warned of, and that move a gain by more than three estimated standard "
    "deviations."
)


def upper(hits: int, of: int) -> float:
    """Upper end of the one-sided 95 % interval of a share [%]."""
    return 100.0 * float(stats.beta.ppf(0.95, hits + 1, of - hits)) if hits < of else 100.0


def share(hits: int, of: int) -> str:
    """A share with its upper bound."""
    return f"{hits} of {of}, below {upper(hits, of):.1f} %" if of else "-"


def summary(sound: Sequence[Sound], faulty: Sequence[Faulty]) -> str:
    """Three sentences."""
    fair = [each for each in sound if not each.case.biased]
    apart = [each for each in fair if each.case.group == APART]
    seen = [each for each in faulty if each.judged.visible]
    named = sum(each.judged.verdict is Verdict.RIGHT for each in seen)
    other = sum(each.judged.verdict is Verdict.OTHER for each in faulty)
    harmful = [each for each in faulty if _harmful(each)]
    unseen = sum(not each.judged.visible for each in harmful)
    return (
        f"In {len(fair)} sets of fault-free logs of {len({each.case.arm for each in fair})} arms, a false alarm was "
        f"given {sum(each.accused for each in fair)} times (on arms that were not used to set constants: "
        f"{share(sum(each.accused for each in apart), len(apart))}), and gains were refused "
        f"{sum(each.refused for each in fair)} times. Of {len(seen)} faults that logs can show, {named} were named "
        f"({100.0 * named / max(1, len(seen)):.0f} %); of all {len(faulty)} faults, {other} were named as another one. "
        f"{len(harmful)} faults that move a gain by more than three estimated standard deviations were not named; "
        f"{unseen} of them cannot be seen in any log."
    )


def _groups(sound: Sequence[Sound], key: Callable[[Sound], str]) -> dict[str, list[Sound]]:
    found: dict[str, list[Sound]] = {}
    for each in sound:
        found.setdefault(key(each), []).append(each)
    return found


def sound_table(sound: Sequence[Sound], title: str, key: Callable[[Sound], str]) -> Table:
    """False alarms by something."""
    columns = (
        Column(title=title, words=True),
        Column(title="Sets of logs"),
        Column(title="False alarms"),
        Column(title="Upper bound", unit="%"),
        Column(title="Refused"),
        Column(title="Gains off"),
        Column(title="Largest z, median"),
        Column(title="Largest z, most"),
        Column(title="Time", unit="s"),
    )
    rows = [
        _sound_row(str(name), found) for name, found in sorted(_groups(sound, key).items(), key=lambda x: str(x[0]))
    ]
    fair = [each for each in sound if not each.case.biased]
    for group in (SET, APART):
        rows.append(_sound_row(f"all, {group}", [each for each in fair if each.case.group == group]))
    rows.append(_sound_row("all whose gains are biased", [each for each in sound if each.case.biased]))
    return Table(columns=columns, rows=tuple(rows))


def _sound_row(name: str, found: Sequence[Sound]) -> tuple[Cell, ...]:
    hits = sum(each.accused for each in found)
    errors = [x for each in found for x in sigmas(each.case, each.run)]
    z = [each.run.largest_z for each in found if each.run.largest_z is not None]
    off = sum(abs(x) > 3.0 for x in errors)
    return cells(
        name,
        str(len(found)),
        str(hits),
        f"{upper(hits, len(found)):.1f}" if found else "-",
        str(sum(each.refused for each in found)),
        f"{off} of {len(errors)}" if errors else "-",
        f"{np.median(z):.1f}" if z else "-",
        f"{max(z):.1f}" if z else "-",
        f"{np.median([each.run.seconds for each in found]):.1f}" if found else "-",
    )


def wrong_table(sound: Sequence[Sound]) -> Table:
    """Each mistake named that nobody made."""
    columns = (
        Column(title="Logs", words=True),
        Column(title="Arm is", words=True),
        Column(title="Said", words=True),
        Column(title="z"),
        Column(title="Severity", words=True),
    )
    rows = [
        cells(each.case.name, each.case.group, one.sentence, _z(one.z), one.severity)
        for each in sound
        for one in accusations(each.run)
        if one.name in each.wrong
    ]
    rows += [
        cells(each.case.name, each.case.group, each.run.message, "-", "refused")
        for each in sound
        if each.run.error is not None and not each.run.said
    ]
    return Table(columns=columns, rows=tuple(rows))


def _z(z: float | None) -> str:
    return "-" if z is None else f"{z:.1f}"


def power_table(faulty: Sequence[Faulty]) -> Table:
    """What became of each kind."""
    return _verdicts(faulty, "Fault", lambda each: each.fault.kind)


def size_table(faulty: Sequence[Faulty]) -> Table:
    """What became of sizes of those kinds that have them."""
    sized = [each for each in faulty if each.fault.value is not None]
    return _verdicts(sized, "Fault and size", _sized)


def _sized(each: Faulty) -> str:
    value, unit = each.fault.value, each.fault.unit
    assert value is not None, "asked of sizes only"
    shown = {"rad": (np.rad2deg(value), "degrees"), "m": (1e3 * value, "mm"), "s": (1e3 * value, "ms")}
    number, unit = shown.get(unit, (value, unit))
    if each.fault.kind in ("lost samples", "lost samples, time even", "repeated samples"):
        number, unit = 100.0 * value, "%"
    return f"{each.fault.kind}, {abs(number):.4g} {unit}".rstrip()


def _verdicts(faulty: Sequence[Faulty], title: str, key: Callable[[Faulty], str]) -> Table:
    columns = (
        Column(title=title, words=True),
        Column(title="Tried"),
        *(Column(title=each.value) for each in (Verdict.RIGHT, Verdict.OTHER, Verdict.REFUSED)),
        Column(title="warned or silent, harmless"),
        Column(title="small"),
        Column(title="harmful"),
        Column(title="harmful, unseen"),
    )
    names = list(dict.fromkeys(sorted(key(each) for each in faulty)))
    rows = [_verdict_row(name, [each for each in faulty if key(each) == name]) for name in names]
    return Table(columns=columns, rows=(*rows, _verdict_row("all", faulty)))


def _verdict_row(name: str, found: Sequence[Faulty]) -> tuple[Cell, ...]:
    verdicts = Counter(each.judged.verdict for each in found)
    quiet = [each for each in found if each.judged.cost is not None]
    harmful = [each for each in quiet if _harmful(each)]
    small = sum(each.judged.cost is Cost.SMALL for each in quiet)
    return cells(
        name,
        str(len(found)),
        *(str(verdicts[each]) for each in (Verdict.RIGHT, Verdict.OTHER, Verdict.REFUSED)),
        str(len(quiet) - small - len(harmful)),
        str(small),
        str(sum(each.judged.visible for each in harmful)),
        str(sum(not each.judged.visible for each in harmful)),
    )


def _harmful(each: Faulty) -> bool:
    return each.judged.cost is Cost.HARMFUL and not each.fault.harmless


def confusion_table(faulty: Sequence[Faulty]) -> Table:
    """What was named in place of what."""
    wrong = [each for each in faulty if each.judged.verdict is Verdict.OTHER]
    names = sorted({name for each in wrong for name in each.judged.others})
    kinds = sorted({each.fault.kind for each in wrong})
    many = Counter((each.fault.kind, name) for each in wrong for name in each.judged.others)
    columns = (Column(title="Put in", words=True), *(Column(title=name) for name in names))
    rows = [cells(kind, *(str(many[kind, name]) for name in names)) for kind in kinds]
    return Table(columns=columns, rows=tuple(rows))


def silent_table(faulty: Sequence[Faulty]) -> Table:
    """Every fault that is passed over and harms, the worst first."""
    columns = (
        Column(title="Logs and fault", words=True),
        Column(title="Error", unit="estimated standard deviations"),
        Column(title="Residual without noise", unit="%"),
        Column(title="Warnings", words=True),
        Column(title="Said of such faults", words=True),
    )
    found = sorted((each for each in faulty if _harmful(each)), key=lambda each: -each.judged.worst)
    return Table(columns=columns, rows=tuple(_silent_row(each) for each in found))


def _silent_row(each: Faulty) -> tuple[Cell, ...]:
    twin = each.run.twin
    left = "-" if twin is None else f"{100.0 * twin.residual:.2g}" if each.judged.visible else "unseen"
    warned = ", ".join(each.judged.others) or "-"
    return cells(each.run.name, f"{each.judged.worst:.1f}", left, warned, "; ".join(_told(each)) or "-")


def _told(each: Faulty) -> list[str]:
    """What the lines on excluded faults, and on those that cannot be told, say of faults of this kind."""
    names = RULES[each.fault.kind].names if each.fault.kind in RULES else ()
    excluded = [words for family, words in each.run.excluded if family in names and "beyond" in words]
    return excluded + [words for words in each.run.untold if any(name.split()[-1] in words for name in names)]


def constants() -> Table:
    """Those that decide, and what each was set on."""
    columns = (Column(title="Constant", words=True), Column(title="Value"), Column(title="Set on", words=True))
    rows = (
        cells("z beyond which an alternative is accepted", f"{SHOWN:g}", "set by the largest z of fault-free logs"),
        cells(
            "z beyond which two alternatives are distinguished",
            f"{TIE:g}",
            "set by faults that were named as another one",
        ),
        cells("Time blocks of each log", f"{BLOCKS}", "with 8 the standard error of z was heavy-tailed"),
        cells(
            "Improvement on subsampled states for an exact comparison",
            f"{WORTH:g}",
            "that of z = 4 if residuals were white",
        ),
        cells(
            "Error of a gain that is reported",
            f"{MATTERS:g} standard deviations",
            "half of what the interval allows for",
        ),
        cells("Error of a gain that refuses it", f"{SPOILS:g} standard deviations", "no interval contains it"),
        cells(
            "Largest error of a zero for which the first order is valid",
            f"{np.rad2deg(LARGEST):g} degrees",
            "error of a sine: 1 %",
        ),
        cells("Diagnoses that are remarks", f"{len(REMARKS)}", ", ".join(REMARKS)),
    )
    return Table(columns=columns, rows=rows)
