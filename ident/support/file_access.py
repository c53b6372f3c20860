"""Access to files of the user: regular files of bounded size, or a one-line error.

A file is read only after it is known to be regular, so that pipes cannot block and devices cannot deliver endless data.
"""

import os
import stat
from pathlib import Path

from ident.support.naming import one_line

KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


def check_file(path: Path, *, most_bytes: int, error: type[ValueError]) -> None:
    """Check that a file is regular, not empty, not too large, and readable.

    Args:
        path: The file.
        most_bytes: Largest size [bytes].
        error: Class of the error.

    Raises:
        ValueError: Of class `error`, one line that begins with the path.
    """
    try:
        found = os.stat(path)
    except FileNotFoundError:
        raise error(f"{one_line(path)}: no such file") from None
    except (OSError, ValueError) as fault:
        reason = fault.strerror if isinstance(fault, OSError) and fault.strerror else one_line(fault)
        raise error(f"{one_line(path)}: {reason}") from fault
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for is_kind, name in KINDS if is_kind(found.st_mode)), "no file")
        raise error(f"{one_line(path)}: is {kind}; expected a regular file")
    if found.st_size == 0:
        raise error(f"{one_line(path)}: the file is empty")
    if found.st_size > most_bytes:
        raise error(
            f"{one_line(path)}: {found.st_size / 1e6:.4g} MB are too much; such files are read up to "
            f"{most_bytes / 1e6:.4g} MB"
        )


def read_bytes(path: Path, *, most_bytes: int, error: type[ValueError]) -> bytes:
    """Return the content of a regular file.

    Raises:
        ValueError: Of class `error`, as `check_file`.
    """
    check_file(path, most_bytes=most_bytes, error=error)
    try:
        return path.read_bytes()
    except OSError as fault:
        raise error(f"{one_line(path)}: {fault.strerror or 'not readable'}") from fault
