"""What the docstrings of classes say of their attributes."""

import re
from inspect import cleandoc

ATTRIBUTE = re.compile(r"^    (\w+(?:, \w+)*): (.*(?:\n {8}.*)*)", re.MULTILINE)
"""An entry of a docstring's `Attributes:` section, with the lines that go on."""


def attribute_docs(kind: type) -> dict[str, str]:
    """What the docstring of a class says of each attribute, as one line without the full stop."""
    section = cleandoc(kind.__doc__ or "").partition("Attributes:\n")[2]
    found: dict[str, str] = {}
    for names, text in ATTRIBUTE.findall(section):
        found |= dict.fromkeys(names.split(", "), " ".join(text.split()).removesuffix("."))
    return found
