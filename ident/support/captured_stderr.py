"""Capture of standard error of C++ libraries."""

import os
import sys
import tempfile
from collections.abc import Generator
from contextlib import contextmanager

from ident.support.naming import one_line

STDERR = 2


@contextmanager
def captured_stderr() -> Generator[list[str]]:
    """Collect the lines that are written to file descriptor 2, below Python.

    Yields:
        A list that holds the lines once the block has ended.
    """
    lines: list[str] = []
    try:
        kept = os.dup(STDERR)
    except OSError:  # nothing to capture without stderr
        yield lines
        return
    try:
        with tempfile.TemporaryFile() as caught:
            if sys.stderr is not None:
                sys.stderr.flush()
            os.dup2(caught.fileno(), STDERR)
            try:
                yield lines
            finally:
                os.dup2(kept, STDERR)
                caught.seek(0)
                text = caught.read().decode("utf-8", "replace")
                lines += [line for raw in text.splitlines() if (line := one_line(raw))]
    finally:
        os.close(kept)
