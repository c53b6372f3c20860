"""What Python may import from: not from the folder that the user happens to work in."""

import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""Where this project's packages lie."""


FOREIGN = "PYTHONPATH"
"""Environment variable whose folders come before those that this project was installed with."""
COMPILED = ("pinocchio", "eigenpy", "coal", "hppfcl", "mujoco", "numpy", "scipy", "pandas", "pyarrow", "pydantic_core")
"""Packages with compiled parts, which work with the Python alone that they were built for."""


def own_packages_first() -> None:
    """Put folders of PYTHONPATH with compiled packages behind those that this project was installed with.

    Every shell with a ROS environment has one, with a Pinocchio of another version or Python. Where there is no other
    package of that name, the folder stays where it is. Called before any of these is imported.
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
    """Whether a package lies in a folder; one without a file of its own gives way to any other."""
    return os.path.isfile(os.path.join(folder, name, "__init__.py"))


def leave_working_folder() -> None:
    """Take the working folder off the import path, unless this project lies there.

    `python -m` puts it first, where a `sim.py` or `ident.py` of the user's would be taken for a package of this
    project. Called before these are imported, hence nothing is imported here that is not loaded already.
    """
    if sys.path and not sys.flags.safe_path and sys.path[0] in ("", os.getcwd()) and os.getcwd() != ROOT:
        del sys.path[0]
