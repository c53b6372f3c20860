"""The links of a model file as it draws them: what gains are held against."""

from pathlib import Path

from ident.support.arrays import Array
from scenarios.experiments.nominal_links import nominal_links
from sim.errors import ModelFileError


def model_links(path: Path, flange: str | None) -> Array | None:
    """Standard parameters of every link with all that is fixed to it, shape (n, 10); None where they cannot be read.

    Args:
        path: MJCF or URDF file of the arm.
        flange: Its last body; joints that do not lead there are held.
    """
    try:
        return nominal_links(path, flange).whole
    except ModelFileError:  # identification needs no masses
        return None
