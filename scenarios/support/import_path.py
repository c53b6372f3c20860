"""Import path of Python, without the working folder."""

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""Folder of this project's packages."""


FOREIGN = "PYTHONPATH"
"""Environment variable whose folders precede the installed packages."""
COMPILED = ("pinocchio", "eigenpy", "coal", "hppfcl", "mujoco", "numpy", "scipy", "pandas", "pyarrow", "pydantic_core")
"""Packages with compiled parts, which need the Python version they were built for."""


def own_packages_first() -> None:
    """Move folders of PYTHONPATH with compiled packages behind the installed packages.

    A ROS environment sets such a folder, with a Pinocchio of another version or Python. If there is no other package of
    that name, the folder is not moved. Call this before these packages are imported.
    """
    given = {os.path.abspath(folder) for folder in os.environ.get(FOREIGN, "").split(os.pathsep) if folder}
    own = [folder for folder in sys.path if os.path.abspath(folder) not in given]
    behind = [
        folder
        for folder in sys.path
        if os.path.abspath(folder) in given
        and any(_has(folder, name) and any(_has(other, name) for other in own) for name in COMPILED)
    ]
    sys.path[:] = [folder for folder in sys.path if folder not in behind] + behind


def _has(folder: str, name: str) -> bool:
    """Return whether a package is in a folder; namespace packages have the lowest priority."""
    return os.path.isfile(os.path.join(folder, name, "__init__.py"))


def leave_working_folder() -> None:
    """Remove the working folder from the import path, unless it contains this project.

    `python -m` adds it as the first entry, where a user's `sim.py` or `ident.py` would replace a package of this
    project. Called before these are imported, so this module imports only modules that are already loaded.
    """
    if sys.path and not sys.flags.safe_path and sys.path[0] in ("", os.getcwd()) and os.getcwd() != ROOT:
        del sys.path[0]
