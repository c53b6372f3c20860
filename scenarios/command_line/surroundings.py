"""What the shell sets that was meant for other programs: packages of another Python, an OpenGL that is not there."""

import contextlib
import os
from collections.abc import Generator, Sequence
from importlib.machinery import PathFinder

from scenarios.support.import_path import COMPILED, FOREIGN

OPENGL = "MUJOCO_GL"
"""Environment variable that names the OpenGL that MuJoCo looks for as it is imported."""
ASKED = "RX90_MUJOCO_GL"
"""Where its value, empty for none, waits for a command that draws, in this process or one that it starts."""


@contextlib.contextmanager
def without_opengl() -> Generator[None]:
    """Let MuJoCo be imported without an OpenGL: what computes alone needs none, whatever the shell asks for."""
    # In a process that a command started: what its shell asked.
    asked = os.environ.get(ASKED, os.environ.get(OPENGL, ""))
    os.environ[OPENGL], os.environ[ASKED] = "disable", asked
    try:
        yield
    finally:
        _ask_for(asked)
        os.environ.pop(ASKED, None)


def with_opengl() -> None:
    """Give MuJoCo the OpenGL that the shell asks for, before it is imported."""
    if ASKED in os.environ:
        _ask_for(os.environ.pop(ASKED))


def _ask_for(opengl: str) -> None:
    if opengl:
        os.environ[OPENGL] = opengl
    else:
        os.environ.pop(OPENGL, None)


def foreign_packages(error: Exception) -> str | None:
    """Why an import may have failed: a compiled package that a folder of PYTHONPATH has.

    Returns:
        What to say, None where PYTHONPATH has no such package or the error is another.
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
    """Whether an error is of an import, or of something that a package of some names lacks."""
    lacking = isinstance(error, AttributeError) and any(f"module '{name}" in str(error) for name in names)
    return lacking or isinstance(error, ImportError)


def _has(folder: str, name: str) -> bool:
    """Whether a package would be imported from a folder; one without a file gives way to any other."""
    found = PathFinder.find_spec(name, [folder])
    return found is not None and found.loader is not None and found.origin is not None
