"""Digests in files of JSON and TOML that commands write: a value that was changed or damaged since is noticed."""

import hashlib
import json
from collections.abc import Mapping

from ident.support.naming import one_line
from scenarios.support.errors import ScenarioError

DIGEST = "digest"
"""Key of the SHA-256 of a file's other values."""


def with_digest(values: Mapping[str, object]) -> dict[str, object]:
    """Return the values of a file that a command writes, with their digest."""
    return {**values, DIGEST: hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()}


def without_digest(stated: object, place: object) -> object:
    """Return the values of a file; raises `ScenarioError` if they do not have its digest, which a file may omit."""
    if not isinstance(stated, dict) or DIGEST not in stated:
        return stated
    values = {key: value for key, value in stated.items() if key != DIGEST}
    if stated != with_digest(values):
        advice = f"write it again, or remove `{DIGEST}` if the change is meant"
        raise ScenarioError(
            f"{one_line(place)}: changed or damaged since it was written, as its digest shows; {advice}"
        )
    return values
