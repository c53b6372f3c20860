"""What a run says, judged by what was done: an accusation that is right, or not, or none, and what silence costs."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from diagnosis_cases import SoundCase
from diagnosis_fault import Fault
from diagnosis_run import Run, Said

TERMS = ("joint elasticity", "friction law", "friction drift", "position-dependent torque", "autocorrelation")
"""What a model lacks; no log is at fault."""
REMARKS = (
    *TERMS, "link masses", "encoder noise", "unexplained", "negative gain", "residual", "gain outlier", "noise of q",
    "noise of v", "joint limits", "rate", "jitter", "encoder resolution", "range", "reversals", "excitation",
    "held currents", "temperature",
)  # fmt: skip
"""Diagnoses that accuse no log, payload or model of a mistake; every other one does."""
NEAR, DEVIATIONS = 0.2, 3.0
"""Relative error and standard deviations within which a size is right."""
UNDONE, RESTORED = 0.2, 0.05
"""Share of the noise-free residual, and relative error of gains, that a right reading may leave."""
SMALL, HARM = 1.0, 3.0
"""Errors of a gain, in estimated standard deviations: harmless up to the first, harmful beyond the second."""
ROUNDING = 1e-6
"""Shares below which a fault changes nothing in logs without noise."""


class Verdict(Enum):
    """What became of a fault."""

    RIGHT = "named"
    OTHER = "named otherwise"
    REFUSED = "refused, no name"
    WARNED = "warned"
    SILENT = "silent"


class Cost(Enum):
    """What silence costs."""

    HARMLESS = "harmless"
    SMALL = "small"
    HARMFUL = "harmful"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """What a right name of a kind of fault is.

    Attributes:
        names: Of diagnoses.
        joints: Whether the diagnosis must be about the joints of the fault; else it must be about all.
        value: What the diagnosis gives as the size, of the fault's value; None where no size is asked for.
        words: Of an error that says it as well.
    """

    names: tuple[str, ...]
    joints: bool | None = True
    value: Callable[[float, str], float] | None = None
    words: str | None = None


def _degrees(value: float, unit: str) -> float:
    """Of a zero that the reading takes back, in the unit of a diagnosis."""
    return -np.rad2deg(value) if unit == "rad" else -1e3 * value


def _percent(value: float, unit: str) -> float:
    """Of a factor that the reading takes back."""
    return 100.0 * (1.0 / value - 1.0)


SIGNS = ("sign", "joint reversed", "current sign", "sign of the gain", "friction sign")
LOST = ("lost samples", "missing samples", "repeated samples", "values")
RULES: dict[str, Rule] = {
    "delay": Rule(names=("delay",), joints=False, value=lambda x, _: 1e3 * x),
    "delay of one joint": Rule(names=("delay",), value=lambda x, _: 1e3 * x),
    "delay of the wrist": Rule(names=("delay",), joints=None),
    "offset of one log": Rule(names=("offset",), joints=None),
    "offset that drifts": Rule(names=("offset", "offset drift"), joints=None),
    "filter of the currents": Rule(names=("delay",), joints=False),
    "zero": Rule(names=("zero",), value=_degrees),
    "zero far off": Rule(names=("zero",), value=_degrees, words="outside the range"),
    "zero in one log": Rule(names=("zero",), value=_degrees, words="outside the range"),
    "sign of q": Rule(names=("sign", "friction sign", "sign of the gain"), words="outside the range"),
    "sign of v": Rule(names=("friction sign",)),
    "sign of q and v": Rule(names=("sign",), words="outside the range"),
    "sign of q in one log": Rule(names=("sign",), words="outside the range"),
    "sign of v in one log": Rule(names=("current sign",)),
    "sign of q and v in one log": Rule(names=("joint reversed",), words="outside the range"),
    "one position in degrees": Rule(names=("unit",), words="degrees|outside the range|jumps"),
    "gear ratio": Rule(names=("unit",), words="gear|outside the range|jumps|degrees"),
    "scale of a position": Rule(names=("unit",)),
    "all positions in degrees": Rule(names=("unit",), joints=None, words="degrees"),
    "scale of a current in one log": Rule(names=("current scale",), value=lambda x, _: x),
    "scale of all currents in one log": Rule(names=("current scale",), joints=False, value=lambda x, _: x),
    "joints exchanged": Rule(names=("order",), words="outside the range"),
    "positions exchanged": Rule(names=("order",), words="outside the range"),
    "currents exchanged": Rule(names=("order",)),
    "joints exchanged in one log": Rule(names=("order",), words="outside the range"),
    "positions exchanged in one log": Rule(names=("order",), words="outside the range"),
    "currents exchanged in one log": Rule(names=("order",)),
    "another order": Rule(names=("order",), joints=False, words="outside the range"),
    "base": Rule(names=("base",), joints=False),
    "base tilted": Rule(names=("base",), joints=False, value=lambda x, _: abs(np.rad2deg(x))),
    "all lengths": Rule(names=("lengths",), joints=False, value=_percent),
    "one length": Rule(names=("lengths",), value=_percent),
    "clock": Rule(names=("clock",), joints=False, value=_percent, words="milliseconds|seconds"),
    "clock of one log": Rule(names=("clock",), joints=False, value=_percent),
    "lost samples": Rule(names=LOST, joints=None),
    "lost samples, time even": Rule(names=LOST, joints=None),
    "repeated samples": Rule(names=LOST, joints=None),
    "gap": Rule(names=LOST, joints=None, words="gap|missing|jumps"),
    "clipping": Rule(names=("clipping",)),
    "wrapped angle": Rule(names=("wrapped",), words="wrapped|a turn"),
    "a turn": Rule(names=("whole turns", "zero"), words="turn|outside the range"),
    "frozen q": Rule(names=("frozen", "repeated samples")),
    "frozen v": Rule(names=("frozen",)),
    "spikes of q": Rule(names=("values",), words="spike|jumps"),
    "spikes of v": Rule(names=("values",), words="spike|such samples"),
    "copied column": Rule(names=("columns",), words="copy"),
    "speed for current": Rule(names=("columns",), words="is the speed"),
    "friction of one log": Rule(names=("friction law", "friction drift"), joints=None),
    "gain by temperature": Rule(names=("current scale", "current drift"), joints=False),
    "mass of the payload": Rule(names=("payload", "payload centre", "payload inertia", "link masses"), joints=None),
    "centre of the payload": Rule(names=("payload", "payload centre"), joints=None),
    "inertia of the payload": Rule(names=("payload", "payload inertia"), joints=None),
    "frame of the payload": Rule(names=("payload", "payload centre", "payload inertia"), joints=None),
    "logs swapped": Rule(names=(), joints=None, words="negative|exchanged|swapped|mounted|load"),
    "same file twice": Rule(names=(), joints=None, words="same motion"),
    "payload not mounted": Rule(names=(), joints=None, words="mounted|no load"),
    "gravity-compensated currents": Rule(names=("gravity compensation",), joints=False),
}
"""Of each kind of fault but two at once."""
FAMILY_OF_WORDS = (
    (r"^q\d+ and v\d+ are negated", "joint reversed"),
    (r"^q\d+ is negated", "sign"),
    (r"^(v\d+ is|all currents are) negated", "current sign"),
    (r"the zero of q", "zero"),
    (r"exchanged|order|shifted", "order"),
    (r"the base", "base"),
    (r"length", "lengths"),
    (r"the clock", "clock"),
    (r"logged .* ms", "delay"),
    (r"scaled by", "current scale"),
    (r"in degrees|gear of ratio|milli|revolutions", "unit"),
    (r"gravity-compensated", "gravity compensation"),
    (r"centre of mass", "payload centre"),
    (r"payload's inertia", "payload inertia"),
)
"""Of alternatives that a diagnosis cannot be told from, which are words only."""


def accuses(one: Said) -> bool:
    """Whether a diagnosis accuses a log, the payload or the geometry of the model."""
    return one.name not in REMARKS


def accusations(found: Run) -> list[Said]:
    """The diagnoses that accuse."""
    return [each for each in found.said if accuses(each)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A run of a fault, judged.

    Attributes:
        verdict: What became of it.
        exact: Whether the name is the one expected, and not one that is the same kinematically.
        others: Accusations beside a right one, or in its place.
        cost: What silence or a warning costs; None where gains were refused or the fault named.
        errors: Error of each gain by the fault, in estimated standard deviations; None without a gain to compare.
        visible: Whether logs without noise show the fault, joint by joint.
    """

    verdict: Verdict
    exact: bool
    others: tuple[str, ...]
    cost: Cost | None
    errors: tuple[float | None, ...]
    visible: bool

    @property
    def worst(self) -> float:
        """Largest error of a gain, in estimated standard deviations."""
        return max((abs(each) for each in self.errors if each is not None), default=0.0)


def judged(case: SoundCase, fault: Fault, found: Run, sound: Run) -> Judged:
    """Judge what was said of a fault, by what is said without it."""
    visible = found.twin is None or found.twin.residual > ROUNDING
    known = [(each.name, each.joints, each.logs) for each in sound.said]
    blamed = [each for each in accusations(found) if (each.name, each.joints, each.logs) not in known]
    names = tuple(dict.fromkeys(each.name for each in blamed))
    exact = [each for each in blamed if right(case, fault, each)]
    rivals = any(_is_rival(case, fault, each) for each in blamed)
    by_words = found.error is not None and not found.said and _says(fault, found.message)
    same = found.twin is not None and found.twin.left is not None and found.twin.left < UNDONE
    same = same and found.twin.still is not None and found.twin.still < RESTORED  # pyright: ignore
    errors = changes(found, sound)
    kwargs = {"errors": errors, "visible": visible}
    if exact or rivals or by_words or (blamed and same):
        others = tuple(each.name for each in blamed if each not in exact)
        return Judged(verdict=Verdict.RIGHT, exact=bool(exact) or by_words, others=others, cost=None, **kwargs)
    if blamed:
        return Judged(verdict=Verdict.OTHER, exact=False, others=names, cost=None, **kwargs)
    lost = found.error is not None or _refused(found) > _refused(sound)
    worst = max((abs(each) for each in errors if each is not None), default=0.0)
    cost = Cost.HARMFUL if worst > HARM else Cost.SMALL if worst > SMALL else Cost.HARMLESS
    if found.error is not None or (lost and cost is Cost.HARMLESS):
        return Judged(verdict=Verdict.REFUSED, exact=False, others=(), cost=None, **kwargs)
    new = {each.name for each in found.said} - {each.name for each in sound.said}
    verdict = Verdict.WARNED if new else Verdict.SILENT
    return Judged(verdict=verdict, exact=False, others=tuple(sorted(new)), cost=cost, **kwargs)


def right(case: SoundCase, fault: Fault, one: Said) -> bool:
    """Whether an accusation is that of what was done, its place and size included."""
    if fault.kind == "two at once":
        ours = not one.joints or set(one.joints) <= set(fault.joints)
        return ours and any(one.name in RULES[kind].names for kind in _kinds(fault))
    rule = RULES[fault.kind]
    if one.name not in rule.names:
        return False
    if rule.joints is True and not (set(one.joints) <= set(fault.joints) and one.joints):
        return False
    if rule.joints is False and one.joints:
        return False
    if one.z is not None and not _same_logs(case, fault, one.logs):
        return False
    if rule.value is None or one.value is None or fault.value is None:
        return True
    return _near(fault.kind, rule.value(fault.value, fault.unit), one)


def _near(kind: str, true: float, one: Said) -> bool:
    assert one.value is not None, "asked of sizes only"
    off = one.value - true
    if kind.startswith("zero"):
        off = (off + 180.0) % 360.0 - 180.0
    scale = abs(true - 1.0) if "current" in kind or kind == "gain by temperature" else abs(true)
    return bool(abs(off) < max(NEAR * scale, DEVIATIONS * (one.std or 0.0)))


def _same_logs(case: SoundCase, fault: Fault, logs: Sequence[str]) -> bool:
    names = tuple(each.recording.name for each in case.motions)
    every = len(fault.logs) == len(names)
    return every if not logs else set(logs) == {names[k] for k in fault.logs}


def _is_rival(case: SoundCase, fault: Fault, one: Said) -> bool:
    """Whether an accusation says that it cannot be told from what was done."""
    if fault.kind == "two at once":
        return False
    rule = RULES[fault.kind]
    for words in one.rivals:
        family = next((name for pattern, name in FAMILY_OF_WORDS if re.search(pattern, words)), words)
        joints = {int(x) - 1 for x in re.findall(r"\b[qv](\d+)\b", words)}
        if family == "order" or family == "lengths":
            joints |= {int(x) - 1 for x in re.findall(r"\b(\d+)\b", words.split(" alone")[0].split(" in ")[0])}
        if family in rule.names and (rule.joints is not True or not joints or joints & set(fault.joints)):
            return True
    return False


def _says(fault: Fault, message: str) -> bool:
    return any((words := RULES[kind].words) is not None and re.search(words, message) for kind in _kinds(fault))


def _kinds(fault: Fault) -> list[str]:
    """Of a fault, both of two at once."""
    return re.findall(r"(?:^|; )(\D[^,;]*),", fault.words) if fault.kind == "two at once" else [fault.kind]


def changes(found: Run, sound: Run) -> tuple[float | None, ...]:
    """Error of each gain by a fault, in its estimated standard deviations."""
    return tuple(
        None if now is None or before is None else (now[0] - before[0]) / max(now[1], now[2])
        for now, before in zip(found.gains, sound.gains, strict=False)
    )


def sigmas(case: SoundCase, found: Run) -> tuple[float, ...]:
    """Errors of the gains of a fault-free case, in estimated standard deviations; none for a real one."""
    if case.gain is None:
        return ()
    return tuple(
        (each[0] - float(true)) / each[1]
        for each, true in zip(found.gains, case.gain, strict=False)
        if each is not None
    )


def _refused(found: Run) -> int:
    return sum(each is None for each in found.gains)
