"""Import path of Python, settled before other modules are imported: this module imports only what Python has loaded."""

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
    that name, the folder is not moved.
    """
    given = {os.path.abspath(folder) for folder in os.environ.get(FOREIGN, "").split(os.pathsep) if folder}
    own = [folder for folder in sys.path if os.path.abspath(folder) not in given]

    def has(folder: str, name: str) -> bool:  # a namespace package has the lowest priority
        return os.path.isfile(os.path.join(folder, name, "__init__.py"))

    behind = [
        folder
        for folder in sys.path
        if os.path.abspath(folder) in given
        and any(has(folder, name) and any(has(other, name) for other in own) for name in COMPILED)
    ]
    sys.path[:] = [folder for folder in sys.path if folder not in behind] + behind


def leave_working_folder() -> None:
    """Remove the working folder, which `python -m` adds as the first entry, unless it contains this project.

    A user's `sim.py` or `ident.py` there would replace a package of this project.
    """
    if sys.path and not sys.flags.safe_path and sys.path[0] in ("", os.getcwd()) and os.getcwd() != ROOT:
        del sys.path[0]
