"""Exit statuses of `rx90`."""

from enum import IntEnum


class Status(IntEnum):
    """How a command ended."""

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
    Status.MISSED: "a tolerance was missed, or a check found something wrong",
    Status.BAD_INPUT: "bad input: one line on stderr says what, where, what to do",
    Status.UNFORESEEN: "internal error: please report it (RX90_TRACEBACK=1 shows where)",
    Status.NO_OUTPUT: "standard output is closed, or cannot be written",
    Status.HUNG_UP: "the terminal was closed (SIGHUP)",
    Status.INTERRUPTED: "Ctrl-C",
    Status.NOBODY_READS: "the reader of the output has closed it, as in rx90 list | head -1",
    Status.ENDED: "ended from outside (SIGTERM)",
}
"""What each means, as `rx90 --help` says it."""
