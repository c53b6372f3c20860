"""Equations as MathML, which browsers draw by themselves: no script and no font is loaded."""

import re
from html import unescape

from latex2mathml.converter import convert

MARKED = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
"""What `pymdownx.arithmatex` leaves of `$..$` and `$$..$$`."""


def typeset(html: str) -> str:
    """The page with every equation set."""
    return MARKED.sub(_equation, html)


def _equation(found: re.Match[str]) -> str:
    latex = unescape(found[3]).strip()
    return convert(latex, display="block" if found[2] == "[" else "inline")
