"""The command `rx90`, also `python -m scenarios`."""

import os
import sys

from scenarios.support.import_path import leave_working_folder, own_packages_first

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def main() -> int:
    """Run the command line in a separate process."""
    own_packages_first()
    import warnings  # after the import path is settled

    from scenarios.cli import main as command_line

    for name in ONE_THREAD:  # small matrices gain nothing from a threaded BLAS, and stall now and then
        os.environ.setdefault(name, "1")
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # warnings are for developers; messages inform the user
    return command_line()


if __name__ == "__main__":
    leave_working_folder()
    sys.exit(main())
