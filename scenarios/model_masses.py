"""The masses of a model file as a witness: one more consistency test, where the file has masses."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from ident.consistency import Check
from ident.consistency.own_weight import NAME, check_own_weight
from scenarios.patching.drawn_links import drawn_links
from sim.errors import ModelFileError


def with_masses(checks: Mapping[str, Check], path: Path, flange: str | None) -> dict[str, Check]:
    """Consistency tests, before them that of the model's masses where they can be read.

    Args:
        checks: The others.
        path: MJCF or URDF file of the arm.
        flange: Its last body; joints that do not lead there are held.
    """
    try:
        drawn = drawn_links(path, flange)
    except ModelFileError:  # no masses, no witness: identification needs none
        return dict(checks)
    return {NAME: partial(check_own_weight, links=drawn.own + drawn.carried), **checks}
