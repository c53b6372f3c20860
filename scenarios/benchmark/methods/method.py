"""A method: how it is called, and which files decide what it answers."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a comparison.

    Attributes:
        text: As it was named.
        words: The command that answers, without its last word, the problem's folder; none of a method in Python.
        digests: Digest of each file of the method's own that is known, and version of each package that it imports
            beside those of every study, by name: another digest or version, another method.
    """

    text: str
    words: tuple[str, ...] = ()
    digests: tuple[tuple[str, str], ...] = ()


def digests(paths: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    """Name and digest of each file, 16 hexadecimal digits."""
    return tuple((path.name, hashlib.sha256(path.read_bytes()).hexdigest()[:16]) for path in paths)
