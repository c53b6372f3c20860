"""Descriptions of attributes from docstrings of classes."""

import re
from inspect import cleandoc

ATTRIBUTE = re.compile(r"^    (\w+(?:, \w+)*): (.*(?:\n {8}.*)*)", re.MULTILINE)
"""An entry of a docstring's `Attributes:` section, with its continuation lines."""


def attribute_docs(kind: type) -> dict[str, str]:
    """Return the description of each attribute in the docstring of a class, as one line without the full stop."""
    section = cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2]
    found: dict[str, str] = {}
    for names, text in ATTRIBUTE.findall(section):
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()).removesuffix("."))
    return found
