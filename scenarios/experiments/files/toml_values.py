"""Values as TOML has them, each on one line."""

import json
from collections.abc import Mapping

DELETE = "\x7f"
"""The one control character that a string of JSON may hold and one of TOML may not."""


def toml_value(value: object) -> str:
    """A value on one line of TOML: a string, number, truth value, or a list or table of these with bare keys."""
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{key} = {toml_value(inner)}" for key, inner in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, float):
        return repr(float(value))
    return json.dumps(value, ensure_ascii=False).replace(DELETE, "\\u007f")
