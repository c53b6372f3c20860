"""Report of methods on public recordings: runs, gains, agreement, predictions, refusals, missing recordings."""

from collections.abc import Sequence

from scenarios.benchmark.scoreboard.results import Agreement, Entry, Scoreboard
from scenarios.reports.content import (
    NONE,
    Cell,
    Column,
    Heading,
    Mood,
    Paragraph,
    Part,
    Report,
    Table,
    cells,
    number,
    percent,
    rounded,
)
from scenarios.reports.gains import joint_numbers, sentence

UNTRIED = "untried: this project has not read any file of this format"
ENTRIES = (
    Column(title="Recordings", words=True),
    Column(title="Licence", words=True, file_only=True),
    Column(title="Status", words=True),
)
METHODS = (
    Column(title="Method", words=True),
    Column(title="Gains"),
    Column(title="Refused"),
    Column(title="Refused\nrightly"),
    Column(title="Given\nwrongly"),
    Column(title="Within\n2 sigma"),
    Column(title="Compared"),
    Column(title="Failed"),
    Column(title="Time", unit="min"),
)
METHODS_SAID = (
    "Refused rightly, given wrongly: joints of sets without a payload, whose gains the data cannot determine. Within "
    "2 sigma: "
    "gains of sets that share no recording, whose difference is within two of its standard deviations; 95 % are "
    "expected."
)
GAINS = (
    Column(title="Set", words=True),
    Column(title="Method", words=True),
    Column(title="Joint"),
    Column(title="Gain", unit="N m/unit"),
    Column(title="2 sigma", unit="%"),
    Column(title="Published", unit="N m/unit"),
    Column(title="Difference", unit="%"),
)
RATIOS = (
    Column(title="Set", words=True),
    Column(title="Joint"),
    Column(title="Reference"),
    Column(title="Gain ratio"),
    Column(title="2 sigma", unit="%"),
    Column(title="Difference\nfrom published", unit="%"),
)
AGREEMENTS = (
    Column(title="Sets", words=True),
    Column(title="Method", words=True),
    Column(title="Joints"),
    Column(title="Within 2 sigma"),
    Column(title="Largest difference", unit="%"),
)
PREDICTIONS = (
    Column(title="Arm from", words=True),
    Column(title="Recording", words=True),
    Column(title="Gains", words=True),
    Column(title="Joints", words=True),
    Column(title="Error", unit="%"),
)
WEIGHTS = (
    Column(title="Payload of", words=True),
    Column(title="Gains", words=True),
    Column(title="Estimated from", words=True),
    Column(title="Weighed", unit="kg"),
    Column(title="Estimate", unit="kg"),
    Column(title="2 sigma", unit="kg"),
    Column(title="Error", unit="%"),
)
PREDICTED = (
    "Root mean square of the joints' errors, in % of their rms currents. The arm is identified from the set's bare "
    "motions with the gains in question; on a bare recording a factor common to all gains has no effect. "
    "Errors of different joints are not comparable."
)
SENSORS = (
    Column(title="Joint"),
    Column(title="Sensor", words=True),
    Column(title="Sensor\nper motor"),
    Column(title="2 sigma", unit="%"),
    Column(title="Residual", unit="% of rms"),
)
SENSORS_SAID = "Sensor per motor: slope of the sensor's torque over the motor's; 2 sigma: for white residuals."


def scoreboard_report(found: Scoreboard) -> Report:
    """Return the scoreboard: verdict, a row per entry and method, details, how to get missing recordings."""
    ran = [each for each in found.entries if each.status == "run"]
    parts: list[Part] = [_verdict(found), Table(columns=ENTRIES, rows=tuple(map(_entry_row, found.entries)))]
    if any(each.refusals for each in ran):
        rows = tuple(_method_row(method, ran) for method in found.methods)
        parts += [Table(title="Methods, all recordings together", columns=METHODS, rows=rows), Paragraph(METHODS_SAID)]
    for each in ran:
        parts += _entry_parts(each)
    others = [each for each in found.entries if each.status != "run"]
    if others:
        parts.append(Heading("Missing recordings, and how to get them"))
    for each in others:
        lacking = f" Missing: {', '.join(each.missing)}." if each.missing else ""
        failed = "" if each.reason is None else f" Not usable: {each.reason}."
        untried = f" ({UNTRIED})" if each.untried else ""
        parts.append(
            Paragraph(f"{each.name}{untried}: {each.source}; licence: {each.licence}.{lacking}{failed} {each.get}")
        )
    return Report("Scoreboard on public recordings", tuple(parts), found.model_dump(mode="json"))


def _verdict(found: Scoreboard) -> Paragraph:
    ran = [each for each in found.entries if each.status == "run"]
    pairs = [pair for each in ran for pair in each.agreements]
    compared, within = sum(pair.joints for pair in pairs), sum(pair.within for pair in pairs)
    wrong = sum(each.wrong for entry in ran for each in entry.refusals)
    unusable = sum(each.status == "unusable" for each in found.entries)
    said = f"{len(ran)} of {len(found.entries)} recordings run"
    said += f", {unusable} not usable" if unusable else ""
    if compared:
        said += f"; gains of sets without a common recording agree within 2 sigma on {within} of {compared} joints"
    said += f"; {wrong} gains given that the data cannot determine."
    return Paragraph(said, Mood.BAD if wrong or unusable else Mood.PLAIN, strong=True)


def _entry_row(each: Entry) -> tuple[Cell, ...]:
    mood = {"run": Mood.GOOD, "missing": Mood.DOUBTFUL, "unusable": Mood.BAD}[each.status]
    return cells(each.name, each.licence, Cell(f"{each.status}{', untried' if each.untried else ''}", mood))


def _method_row(method: str, ran: Sequence[Entry]) -> tuple[Cell, ...]:
    own = [row for each in ran for row in each.refusals if row.method == method]
    pairs: list[Agreement] = [pair for each in ran for pair in each.agreements if pair.method == method]
    sums = [sum(getattr(row, key) for row in own) for key in ("given", "refused", "right", "wrong")]
    agreed = [sum(getattr(pair, key) for pair in pairs) for key in ("within", "joints")]
    minutes = sum(row.seconds for row in own) / 60.0
    return cells(method, *map(str, (*sums, *agreed, sum(row.failed for row in own))), number(minutes, ".2f"))


def _entry_parts(each: Entry) -> list[Part]:
    parts: list[Part] = [Heading(each.name), Paragraph(f"{each.source}; licence: {each.licence}.")]
    if each.published_by is not None:
        parts.append(Paragraph(f"Published gains: {each.published_by}."))
    given = [gain for gain in each.gains if gain.gain is not None]
    if given:
        rows = [
            cells(
                gain.set,
                gain.method,
                str(gain.joint),
                rounded(gain.gain, None if gain.std is None else 2.0 * gain.std),
                percent(None if gain.std is None or not gain.gain else 2.0 * gain.std / abs(gain.gain), ".1f"),
                number(gain.published, ".3f"),
                percent(gain.rel_difference, "+.1f"),
            )
            for gain in given
        ]
        parts.append(Table(title="Gains", columns=GAINS, rows=tuple(rows)))
    if each.ratios:
        rows = [
            cells(
                ratio.set,
                str(ratio.joint),
                str(ratio.reference),
                rounded(
                    ratio.ratio,
                    None if ratio.rel_std is None or ratio.ratio is None else 2.0 * ratio.rel_std * abs(ratio.ratio),
                ),
                percent(None if ratio.rel_std is None else 2.0 * ratio.rel_std, ".1f"),
                percent(ratio.rel_difference, "+.1f"),
            )
            for ratio in each.ratios
        ]
        parts.append(Table(title="Ratios of gains from bare motions", columns=RATIOS, rows=tuple(rows)))
    if each.agreements:
        rows = [
            cells(" and ".join(a.sets), a.method, str(a.joints), str(a.within), percent(a.largest, ".1f"))
            for a in each.agreements
        ]
        parts.append(Table(title="Sets that share no recording", columns=AGREEMENTS, rows=tuple(rows)))
    if each.predictions:
        rows = [
            cells(p.set, p.log, p.gains, joint_numbers(p.joints), percent(p.rel_error, ".1f")) for p in each.predictions
        ]
        parts.append(
            Table(title="Currents of recordings that were not used in any fit", columns=PREDICTIONS, rows=tuple(rows))
        )
        parts.append(Paragraph(PREDICTED))
    if each.weights:
        rows = [
            cells(
                w.set,
                w.gains,
                w.gains_set or NONE,
                f"{w.mass:g}",
                rounded(w.found, 2.0 * w.std),
                rounded(2.0 * w.std, 2.0 * w.std),
                percent(w.found / w.mass - 1.0, "+.1f"),
            )
            for w in each.weights
        ]
        parts.append(
            Table(
                title="Payloads estimated with gains that were identified without them",
                columns=WEIGHTS,
                rows=tuple(rows),
            )
        )
    if each.sensors:
        rows = [
            cells(
                str(s.joint),
                s.sensor,
                rounded(s.slope, None if s.std is None else 2.0 * s.std),
                percent(None if s.std is None or not s.slope else 2.0 * s.std / abs(s.slope), ".1f"),
                percent(s.rel_error, ".0f"),
            )
            for s in each.sensors
        ]
        parts.append(Table(title="Joint torque sensors against motors", columns=SENSORS, rows=tuple(rows)))
        parts.append(Paragraph(SENSORS_SAID))
    return [*parts, *(Paragraph(sentence(f"Note: {note}")) for note in each.notes)]
