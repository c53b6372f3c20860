"""The command `rx90`, also `python -m scenarios`."""

import gc
import os
import sys

from scenarios.support.import_path import leave_working_folder, own_packages_first

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
NO_PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
"""Environment variable that keeps pydantic from searching all installed packages for plugins."""
OBJECTS = 200_000
"""New objects before Python looks for unreachable cycles: twice what imports create, which all stay."""


def main() -> int:
    """Run the command line in a separate process."""
    try:
        gc.set_threshold(OBJECTS)
        own_packages_first()
        import warnings  # after the import path is settled

        from scenarios.cli import main as command_line
    except KeyboardInterrupt:
        sys.stderr.write("rx90: stopped\n")
        sys.exit(130)  # `Status.INTERRUPTED`, before it can be imported

    for name in ONE_THREAD:  # small matrices gain nothing from a threaded BLAS, and stall now and then
        os.environ.setdefault(name, "1")
    os.environ.setdefault(NO_PLUGINS, "1")
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # warnings are for developers; messages inform the user
    try:
        return command_line()
    finally:
        gc.freeze()  # at exit Python would search all objects for cycles once more, a quarter of the imports' time


if __name__ == "__main__":
    leave_working_folder()
    sys.exit(main())
