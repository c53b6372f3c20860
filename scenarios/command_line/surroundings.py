"""Environment variables meant for other programs: packages of another Python, missing OpenGL backends."""

import contextlib
import os
from collections.abc import Generator, Sequence
from importlib.machinery import PathFinder

from scenarios.support.import_path import COMPILED, FOREIGN

OPENGL = "MUJOCO_GL"
"""Environment variable for the OpenGL backend of MuJoCo, read at import."""
ASKED = "RX90_MUJOCO_GL"
"""Environment variable that keeps its value, empty for none, for commands that render."""


@contextlib.contextmanager
def without_opengl() -> Generator[None]:
    """Import MuJoCo without OpenGL, which is needed only for rendering."""
    # In a child process: the value of the shell.
    asked = os.environ.get(ASKED, os.environ.get(OPENGL, ""))
    os.environ[OPENGL], os.environ[ASKED] = "disable", asked
    try:
        yield
    finally:
        _ask_for(asked)
        os.environ.pop(ASKED, None)


def with_opengl() -> None:
    """Restore the OpenGL backend of the shell before MuJoCo is imported."""
    if ASKED in os.environ:
        _ask_for(os.environ.pop(ASKED))


def _ask_for(opengl: str) -> None:
    if opengl:
        os.environ[OPENGL] = opengl
    else:
        os.environ.pop(OPENGL, None)


def foreign_packages(error: Exception) -> str | None:
    """Return the probable cause of a failed import: a compiled package in a folder of PYTHONPATH.

    Returns:
        The message, None if PYTHONPATH has no such package or the error is another one.
    """
    for folder in os.environ.get(FOREIGN, "").split(os.pathsep):
        found = [name for name in COMPILED if folder and _has(folder, name)]
        if found and _by_import(error, found):
            return (
                f"PYTHONPATH: {folder} has a {found[0]} that cannot be used here ({type(error).__name__}: {error}); "
                "unset PYTHONPATH for rx90, as in: env -u PYTHONPATH rx90 ..."
            )
    return None


def _by_import(error: Exception, names: Sequence[str]) -> bool:
    """Return whether an error is due to an import, or a missing attribute of some packages."""
    lacking = isinstance(error, AttributeError) and any(f"module '{name}" in str(error) for name in names)
    return lacking or isinstance(error, ImportError)


def _has(folder: str, name: str) -> bool:
    """Return whether a package would be imported from a folder; namespace packages have the lowest priority."""
    found = PathFinder.find_spec(name, [folder])
    return found is not None and found.loader is not None and found.origin is not None
