"""A method: its command, and digests of the files that determine its answer."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a comparison.

    Attributes:
        text: Text that names the method.
        words: The command without its last argument, the problem's folder; empty for a method in Python.
        digests: Digest of each known file of the method, and version of each package that it imports (without those of
            every study), by name. With another digest or version the method is a different one.
    """

    text: str
    words: tuple[str, ...] = ()
    digests: tuple[tuple[str, str], ...] = ()


def digests(paths: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    """Return name and digest of each file, 16 hexadecimal digits."""
    return tuple((path.name, hashlib.sha256(path.read_bytes()).hexdigest()[:16]) for path in paths)
