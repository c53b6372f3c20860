"""What Python may import from: not from the folder that the user happens to work in."""

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""Where this project's packages lie."""


def leave_working_folder() -> None:
    """Take the working folder off the import path, unless this project lies there.

    `python -m` puts it first, where a `sim.py` or `ident.py` of the user's would be taken for a package of this
    project. Called before these are imported, hence nothing is imported here that is not loaded already.
    """
    if sys.path and not sys.flags.safe_path and sys.path[0] in ("", os.getcwd()) and os.getcwd() != ROOT:
        del sys.path[0]
