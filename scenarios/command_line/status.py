"""Exit statuses of `rx90`."""

from enum import IntEnum


class Status(IntEnum):
    """Exit status of a command."""

    PASSED = 0
    MISSED = 1
    BAD_INPUT = 2
    UNFORESEEN = 70
    NO_OUTPUT = 74
    HUNG_UP = 129
    INTERRUPTED = 130
    NOBODY_READS = 141
    ENDED = 143


MEANINGS = {
    Status.PASSED: "passed",
    Status.MISSED: "a tolerance was exceeded, or a check found a fault",
    Status.BAD_INPUT: "bad input: a line on stderr states the fault, its place and the remedy",
    Status.UNFORESEEN: "internal error: please report it (RX90_TRACEBACK=1 shows where)",
    Status.NO_OUTPUT: "standard output is closed or not writable",
    Status.HUNG_UP: "the terminal was closed (SIGHUP)",
    Status.INTERRUPTED: "Ctrl-C",
    Status.NOBODY_READS: "broken pipe: the reader closed the output, as in rx90 list | head -1",
    Status.ENDED: "terminated (SIGTERM)",
}
"""Meanings, for `rx90 --help`."""
