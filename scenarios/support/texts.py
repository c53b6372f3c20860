"""Texts: TOML values on one line, the line that names a JSON Schema, descriptions from docstrings, continued commands.

Taplo, and editors that use it, complete and check keys by `#:schema PLACE`.
"""

import json
import re
import shlex
from collections.abc import Mapping
from inspect import cleandoc
from itertools import pairwise
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "schemas"
"""Folder of the schemas in the package."""
ENDING = ".schema.json"


def schema_line(name: str) -> str:
    """Return the first line of a TOML file, which names its schema."""
    return f"#:schema {(FOLDER / f'{name}{ENDING}').as_uri()}"


DELETE = "\x7f"
"""The control character that JSON strings may contain but TOML strings may not."""


def toml_value(value: object) -> str:
    """Return a value as one line of TOML: a string, number, truth value, or a list or table of these with bare keys."""
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{key} = {toml_value(inner)}" for key, inner in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, float):
        return repr(float(value))
    return json.dumps(value, ensure_ascii=False).replace(DELETE, "\\u007f")


ATTRIBUTE = re.compile(r"^    (\w+(?:, \w+)*): (.*(?:\n {8}.*)*)", re.MULTILINE)
"""An entry of a docstring's `Attributes:` section, with its continuation lines."""


def attribute_docs(kind: type) -> dict[str, str]:
    """Return the description of each attribute in the docstring of a class, as one line without the full stop."""
    section = cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2]
    found: dict[str, str] = {}
    for names, text in ATTRIBUTE.findall(section):
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()).removesuffix("."))
    return found


GOES_ON, INDENT = " \\", "  "
"""End of a continued command line, and beginning of the next one."""


def continued(command: str, width: int) -> str:
    """Return a command on continued lines; a line is wider than the page only if one word is."""
    words = [shlex.quote(word) for word in shlex.split(command)]
    if len(command) <= width or " ".join(words) != command:
        return command
    lines = words[:1]
    for word, after in pairwise([*words[1:], "-"]):
        beside = f"{word} {after}" if word.startswith("-") and not after.startswith("-") else word  # option and value
        if len(f"{lines[-1]} {beside}{GOES_ON}") > width:
            lines[-1] += GOES_ON
            lines.append(f"{INDENT}{word}")
        else:
            lines[-1] += f" {word}"
    return "\n".join(lines)
