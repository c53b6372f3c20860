"""What a patch changes and what it leaves alone, joint by joint."""

from dataclasses import dataclass

from scenarios.gains_in_use.model_update.values import Known, Unknown
from scenarios.gains_in_use.model_update.xml_text import Edit


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """An attribute of a joint, changed or not.

    Attributes:
        joint: Its name.
        attribute: As the file calls it.
        before: Its text, or that of its default class; None if there is none.
        after: Its text now; None if it is left alone.
        rel_std: Relative deviation of the new number; None if it is left alone.
        reason: Why it is left alone.
    """

    joint: str
    attribute: str
    before: str | None
    after: str | None = None
    rel_std: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Patched:
    """A change and the edits that make it."""

    change: Change
    edits: tuple[Edit, ...] = ()


def left(joint: str, attribute: str, before: str | None, reason: str) -> Patched:
    """An attribute that is left alone."""
    return Patched(Change(joint=joint, attribute=attribute, before=before, reason=reason))


def shown(value: float) -> str:
    """A number as it is written: its deviation is no smaller than a millionth."""
    return f"{value:.6g}"


def scaled(text: str, factor: float) -> str | None:
    """Numbers of an attribute times a factor; None if they are no numbers."""
    try:
        return " ".join(shown(float(word) * factor) for word in text.split())
    except ValueError:
        return None


def scaled_effort(joint: str, attribute: str, before: str | None, factor: Known) -> Change:
    """An effort limit times a factor: changed where there is a limit and the factor is known."""
    if isinstance(factor, Unknown):
        return Change(joint=joint, attribute=attribute, before=before, reason=factor.reason)
    after = None if before is None else scaled(before, factor.value)
    if after is None or before is None:
        return Change(joint=joint, attribute=attribute, before=before, reason="the model states no limit")
    if not any(map(float, before.split())):
        return Change(joint=joint, attribute=attribute, before=before, reason="a limit of 0 is no limit")
    return Change(joint=joint, attribute=attribute, before=before, after=after, rel_std=factor.rel_std)
