"""Precedence of `belief.exact` and specified standard deviations of payloads: the extending file has priority.

A standard deviation in a file is used even if an extended scenario sets `exact`. If one file has both, this is an
error.
"""

from collections.abc import Mapping
from pathlib import Path

from scenarios.experiments.files.mountings import LOADED
from scenarios.support.errors import WrongValue

DEVIATIONS = ("mass_std", "com_std", "inertia_std")


def is_exact(exact: bool | Mapping[str, bool], name: str) -> bool:
    """Return whether the payload of a mounting is taken as exact; False for an unknown mounting."""
    return exact.get(name, False) if isinstance(exact, Mapping) else exact


def check_exact(table: Mapping[str, object], path: Path) -> None:
    """Check that a file specifies no standard deviations of a payload that it takes as exact.

    Raises:
        WrongValue: If it does (the first one).
    """
    belief = _below(table, "belief")
    for name, key in _deviations(belief).items():
        if _taken_as_exact(belief.get("exact"), name):
            place = "payload" if name == LOADED else f"payloads.{name}"
            raise WrongValue(
                f"{path}: belief.{place}: {key} is specified, but belief.exact sets it to zero; remove one of them"
            )


def exactness(base: Mapping[str, object], over: Mapping[str, object]) -> object:
    """Return `belief.exact` of a file merged with the extended one, None if neither has it."""
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
    """Return the first nonzero standard deviation that is specified for each payload."""
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
    """Return whether a nonzero value is specified."""
    if isinstance(value, Mapping):
        return any(map(_numbers, value.values()))
    return any(map(_numbers, value)) if isinstance(value, list) else value is not None and value != 0


def _below(table: Mapping[str, object], key: str) -> dict[str, object]:
    inner = table.get(key)
    return dict(inner) if isinstance(inner, Mapping) else {}
