"""Text of TOML files that are written for a user: values on one line, and the line that names a JSON Schema.

Taplo, and editors that use it, complete and check keys by `#:schema PLACE`.
"""

import json
from collections.abc import Mapping
from pathlib import Path

FOLDER = Path(__file__).parents[2] / "schemas"
"""Where the schemas lie, in the package."""
ENDING = ".schema.json"


def schema_line(name: str) -> str:
    """The first line of a file that is written for a user, wherever that is."""
    return f"#:schema {(FOLDER / f'{name}{ENDING}').as_uri()}"


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
