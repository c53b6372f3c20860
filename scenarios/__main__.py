"""The command `rx90`, also `python -m scenarios`."""

import os
import sys

STUDIES = ("monte-carlo", "sensitivity")
INTERRUPTED, NOBODY_READS = 130, 141
"""Exit statuses after Ctrl-C, and where the reader of the output has gone, as of `rx90 list | head -1`."""


def main() -> int:
    """Run the command line; workers of a study import what they need while this process does."""
    try:
        if sys.argv[1:2] and sys.argv[1] in STUDIES and "--dask" not in sys.argv:
            from scenarios.workers.executors import prepare_processes

            prepare_processes()
        from scenarios.cli import main as command_line

        status = command_line()
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("rx90: stopped", file=sys.stderr)  # noqa: T201
        status = INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is buffered has nowhere to go
        status = NOBODY_READS
    return status


if __name__ == "__main__":
    sys.exit(main())
