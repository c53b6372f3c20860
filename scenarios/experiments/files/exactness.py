"""`belief.exact` against deviations of payloads that are stated: the file nearest to the reader decides.

A deviation that a file states counts, whatever the scenarios that it extends take as exact. Stated beside an `exact` of
the same file, one of the two is a mistake.
"""

from collections.abc import Mapping
from pathlib import Path

from scenarios.experiments.files.mountings import LOADED
from scenarios.support.errors import WrongValue

DEVIATIONS = ("mass_std", "com_std", "inertia_std")


def is_exact(exact: bool | Mapping[str, bool], name: str) -> bool:
    """Whether the payload of a mounting is taken as exact; one that is not named is not."""
    return exact.get(name, False) if isinstance(exact, Mapping) else exact


def check_exact(table: Mapping[str, object], path: Path) -> None:
    """Check that a file does not state deviations of a payload that it takes as exact.

    Raises:
        WrongValue: At the first that it does.
    """
    belief = _below(table, "belief")
    for name, key in _deviations(belief).items():
        if _taken_as_exact(belief.get("exact"), name):
            place = "payload" if name == LOADED else f"payloads.{name}"
            raise WrongValue(
                f"{path}: belief.{place}: {key} is stated, but belief.exact sets it to zero; remove one of them"
            )


def exactness(base: Mapping[str, object], over: Mapping[str, object]) -> object:
    """What `belief.exact` is once a file lies over what it extends, None where neither says."""
    below, above = _below(base, "belief"), _below(over, "belief")
    exact = above.get("exact", below.get("exact"))
    counting = _deviations(above)
    if "exact" in above or not any(_taken_as_exact(exact, name) for name in counting):
        return exact
    names = {*_payloads(below), *_payloads(above)}
    return {name: name not in counting and _taken_as_exact(exact, name) for name in sorted(names)}


def _taken_as_exact(exact: object, name: str) -> bool:
    return exact is True or (isinstance(exact, Mapping) and exact.get(name) is True)


def _deviations(belief: Mapping[str, object]) -> dict[str, str]:
    """The first deviation that is stated, and is not 0, of each payload."""
    found: dict[str, str] = {}
    for name, payload in _payloads(belief).items():
        if isinstance(payload, Mapping):
            keys = [key for key in DEVIATIONS if _numbers(payload.get(key))]
            found |= {name: keys[0]} if keys else {}
    return found


def _payloads(belief: Mapping[str, object]) -> dict[str, object]:
    single = {LOADED: belief["payload"]} if "payload" in belief else {}
    return {**single, **_below(belief, "payloads")}


def _numbers(value: object) -> bool:
    """Whether anything but zeros is stated."""
    if isinstance(value, Mapping):
        return any(map(_numbers, value.values()))
    return any(map(_numbers, value)) if isinstance(value, list) else value is not None and value != 0


def _below(table: Mapping[str, object], key: str) -> dict[str, object]:
    inner = table.get(key)
    return dict(inner) if isinstance(inner, Mapping) else {}
