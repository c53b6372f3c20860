"""The command `rx90`, also `python -m scenarios`."""

import sys

STUDIES = ("monte-carlo", "sensitivity")


def main() -> int:
    """Run the command line; workers of a study import what they need while this process does."""
    if sys.argv[1:2] and sys.argv[1] in STUDIES and "--dask" not in sys.argv:
        from scenarios.studies.executors import prepare_processes

        prepare_processes()
    from scenarios.cli import main as command_line

    return command_line()


if __name__ == "__main__":
    sys.exit(main())
