"""Mass, centre and inertia of links for a model file, in the frames of that file."""

from dataclasses import dataclass

import numpy as np

from ident.arm_parameters.links import ModelLinks
from ident.model.arm import Arm
from ident.support.arrays import Array
from scenarios.experiments.files.gains import GainsFile
from scenarios.gains_in_use.model_update.values import BareFile
from scenarios.results.models.links import Links, same_frames
from scenarios.support.errors import ScenarioError

SAME = 1e-6
"""Largest difference of frames, in metres or of unit vectors, due to rounding in a file."""
SAME_GAIN = 1e-6
"""Largest relative difference of gains due to rounding in a file."""
FAR = 4.0
"""Largest difference of a base parameter of the consistent links from its estimate, in standard deviations."""
COMMENT = (
    "Masses, centres and inertias of the links are from bare motions and drive gains. Data determine "
    "only the base parameters, combinations of these; of all links with the same base parameters those "
    "nearest to the original model are given. Parameters of single links are not identifiable; joint "
    "torques are. The inertia of motors is in armature{elsewhere}."
)
"""Comment on links in a patched file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkValues:
    """A link without the bodies fixed to it.

    Attributes:
        joint: Name of the joint that moves it.
        mass: Mass [kg].
        com: Centre of mass in the frame of the link [m].
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, axes of the link [kg m^2].
        motor: Inertia of the motor, joint side [kg m^2 or kg]; None if not identifiable.
    """

    joint: str
    mass: float
    com: tuple[float, ...]
    inertia: tuple[float, ...]
    motor: float | None


def link_values(bare: BareFile | None, gains: GainsFile, arm: Arm, nominal: ModelLinks) -> tuple[LinkValues, ...]:
    """Return links for a model file.

    Args:
        bare: Results of bare motions.
        gains: The gains of the updated model.
        arm: The arm of the file.
        nominal: Links of the file.

    Raises:
        ScenarioError: If there are no physically consistent links, or they are of other gains or another model, or
            contradict the data.
    """
    if bare is None:
        raise ScenarioError("--links: no identification of bare motions is given; add --arm A")
    if bare.consistent is None:
        raise ScenarioError(
            "--links: --arm has no physically consistent set: "
            f"{bare.consistent_reason or 'it was written by an older version'}; identify bare motions "
            "with --gains"
        )
    _check(bare.consistent, arm, nominal)
    _check_gains(bare, gains)
    return tuple(
        LinkValues(
            joint=each.name,
            mass=each.mass,
            com=_moved(each.com, nominal.offset[each.joint - 1]),
            inertia=tuple(each.inertia.six),
            motor=each.motor_inertia if each.motor_found else None,
        )
        for each in bare.consistent.links
    )


def _moved(com: tuple[float, ...], offset: Array) -> tuple[float, ...]:
    return tuple((np.array(com) + offset).tolist())


def _check_gains(bare: BareFile, gains: GainsFile) -> None:
    """Check that the links were identified with these gains, to which their masses are proportional."""
    for each, entry in zip(bare.joints, gains.gains, strict=True):
        used, own = each.gain, entry.estimate
        if used is not None and own is not None and abs(used / own - 1.0) > SAME_GAIN:
            raise ScenarioError(
                f"--links: --arm was identified with a gain of {used:.4g} on joint {each.joint}, but --gains has "
                f"{own:.4g}; identify the bare motions with these gains"
            )


def _check(found: Links, arm: Arm, nominal: ModelLinks) -> None:
    if tuple(each.name for each in found.links) != arm.joint_names:
        names = ", ".join(each.name for each in found.links)
        raise ScenarioError(f"--links: --arm is of joints {names}, not of those of MODEL")
    for each in found.links:
        if not same_frames(each, arm, nominal.carried, tolerance=SAME):
            raise ScenarioError(
                f"--links: MODEL has another frame for joint {each.name}, or other bodies fixed to its link, than the "
                "model that bare motions were identified with; identify them with this file"
            )
    if found.farthest_deviations > FAR:
        raise ScenarioError(
            f"--links: base parameter {found.farthest_parameter} of physically consistent links differs by "
            f"{found.farthest_deviations:.2g} standard deviations from its estimate (limit {FAR:g}); check model, "
            "gains and data"
        )
