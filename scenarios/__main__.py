"""The command `rx90`, also `python -m scenarios`."""

import os
import sys

from scenarios.import_path import leave_working_folder

STUDIES = ("monte-carlo", "sensitivity")
NOBODY_READS = 141
"""Exit status where the reader of the output has gone, as of `rx90 list | head -1`."""


def main() -> int:
    """Run the command line; workers of a study import what they need while this process does."""
    from scenarios.stopping import say, status_of, stoppable  # after the import path is settled

    try:
        with stoppable():
            if sys.argv[1:2] and sys.argv[1] in STUDIES:
                from scenarios.workers.choice import prepare_workers

                prepare_workers(sys.argv[2:])
            from scenarios.cli import main as command_line

            status = command_line()
            sys.stdout.flush()
    except KeyboardInterrupt as stopped:
        say("stopped")
        status = status_of(stopped)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is buffered has nowhere to go
        status = NOBODY_READS
    return status


if __name__ == "__main__":
    leave_working_folder()
    sys.exit(main())
