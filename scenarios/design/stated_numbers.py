"""Numbers of a URDF that identification does not use and a simulation believes: masses, inertias, efforts, speeds."""

from pathlib import Path

import numpy as np

from ident.model.files.chain import urdf_to_flange
from ident.model.files.xml_tree import Element, read_xml, vector
from ident.payload.payload import INERTIA_KEYS
from ident.support.errors import RobotModelError
from ident.support.naming import shown

STRONGEST = {"effort": 1e6, "velocity": 1e3}
"""Largest effort [N m, N] and speed [rad/s, m/s] of a joint: the strongest arms that are made have 1e5 N m."""
SLACK = 1e-6
"""Rounding that moments of inertia may have."""


def check_stated_numbers(path: Path, flange: str | None = None) -> None:
    """Check what a URDF states of masses and drives of the arm; files of MuJoCo are its compiler's.

    Args:
        path: The file.
        flange: Last body of the arm; None where all bodies are the arm's.

    Raises:
        RobotModelError: Naming line, element and value of the first that no arm has.
    """
    if path.suffix.lower() != ".urdf":
        return
    root = read_xml(path) if flange is None else urdf_to_flange(read_xml(path), flange)
    for link in root.all("link"):
        for inertial in link.all("inertial"):
            _check_inertial(link, inertial)
    for joint in root.all("joint"):
        for limit in joint.all("limit"):
            for key, most in STRONGEST.items():
                if limit.attributes.get(key, "").lower() in ("inf", "+inf"):  # no limit is stated
                    continue
                value = vector(limit, key, 1, largest=most)
                if value is not None and value[0] < 0.0:
                    raise RobotModelError(f"{limit.title}: {key} = {shown(limit.attributes[key])} is negative")


def _check_inertial(link: Element, inertial: Element) -> None:
    for mass in inertial.all("mass"):
        value = vector(mass, "value", 1)
        if value is not None and value[0] < 0.0:
            raise RobotModelError(f"{mass.title}: value = {shown(mass.attributes['value'])}: a mass is not negative")
    for inertia in inertial.all("inertia"):
        ixx, iyy, izz, ixy, ixz, iyz = ((vector(inertia, key, 1) or (0.0,))[0] for key in INERTIA_KEYS)
        moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        if moments[0] + moments[1] < (1.0 - SLACK) * moments[2]:
            principal = ", ".join(f"{each:.4g}" for each in moments)
            raise RobotModelError(
                f"{inertia.title} of link {shown(link.attributes.get('name', ''))}: no body has principal "
                f"moments {principal} kg m^2: none is negative, and none exceeds the sum of the other two"
            )
