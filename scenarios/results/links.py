"""Physically consistent links, printed by `rx90 identify --json` and read by `rx90 patch`.

Every link is in the frame of its joint: axes of the link in the model file, origin on the joint. Frames and bodies
fixed to the link are included, so that a model with other frames is detected.
"""

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ident.model.arm import Arm
from ident.parameters.links import FoundLinks, ModelLinks
from ident.parameters.payload import body_values
from ident.payload.payload import INERTIA_KEYS
from ident.support.arrays import Array
from scenarios.rendering.content import Mood, Paragraph, Part, column, places_of, table

Vector = tuple[float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]


FAR = 4.0
"""Largest difference of a base parameter of the consistent links from its estimate, in standard deviations."""


class _Open(BaseModel):
    """A JSON object that may have more keys than these."""

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)


class LinkInertia(_Open):
    """Inertia about the centre of mass, along the axes of the link."""

    ixx: float = Field(description="Moment about the first axis [kg m^2]")
    iyy: float = Field(description="Moment about the second axis [kg m^2]")
    izz: float = Field(description="Moment about the third axis [kg m^2]")
    ixy: float = Field(description="Product of the first and second axis [kg m^2]")
    ixz: float = Field(description="Product of the first and third axis [kg m^2]")
    iyz: float = Field(description="Product of the second and third axis [kg m^2]")

    @property
    def six(self) -> tuple[float, float, float, float, float, float]:
        """Values in the order of `INERTIA_KEYS`."""
        return self.ixx, self.iyy, self.izz, self.ixy, self.ixz, self.iyz


class Link(_Open):
    """A physically consistent link, without bodies fixed to it."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    name: str = Field(description="Name of the joint that moves the link")
    mass: float = Field(gt=0.0, description="Mass [kg]")
    com: Vector = Field(description="Centre of mass in the frame of the joint [m]")
    inertia: LinkInertia = Field(description="Inertia about the centre of mass [kg m^2]")
    motor_inertia: float = Field(ge=0.0, description="Rotor inertia, joint side [kg m^2 or kg]")
    motor_unit: str = Field("kg m^2", description="Unit of the rotor inertia")
    motor_found: bool = Field(description="Whether the data determine the rotor inertia; false: taken from the model")
    carried: Ten = Field(description="Parameters of bodies fixed to the link, from the model [kg m^2, kg m, kg]")
    place: Vector = Field(description="Position of the joint in the frame of the preceding one [m]")
    orientation: tuple[Vector, Vector, Vector] = Field(
        description="Rotation matrix of the frame in the preceding one, row by row"
    )
    axis: Vector = Field(description="Axis of the joint, a unit vector")


class Links(_Open):
    """Physically consistent links nearest to the model's."""

    links: tuple[Link, ...] = Field(min_length=1, description="One entry per joint, in order")
    farthest_parameter: str = Field(description="Base parameter that differs most from its unconstrained estimate")
    farthest_deviations: float = Field(
        ge=0.0, description="Difference of that parameter, in standard deviations of the estimate"
    )

    def parts(self) -> list[Part]:
        """Return the links as a table, with the largest deviation from the estimates."""
        units = {each.motor_unit for each in self.links}
        far = self.farthest_deviations
        doubt = "" if far <= FAR else " This is too large; check the model, the gains and the data."
        words = (
            "Data determine only base parameters. Shown are the physically consistent links nearest to the model that "
            f"have these base parameters. {self.farthest_parameter} differs most from its estimate, by {far:.2g} "
            f"standard deviations.{doubt}"
        )
        listed = table(
            self.links,
            column("Joint", lambda each: each.joint),
            column("Mass [kg]", lambda each: f"{each.mass:#.4g}"),
            column("Centre [m]", lambda each: " ".join(f"{x:z.4f}" for x in each.com), words=True),
            column("ixx iyy izz ixy ixz iyz [kg m^2]", lambda each: _alike(each.inertia.six), words=True),
            column(
                f"Motor [{units.pop() if len(units) == 1 else 'kg (m^2)'}]", lambda each: f"{each.motor_inertia:#.4g}"
            ),
            title="Physically consistent links, in SI, each in the frame of its joint",
        )
        return [listed, Paragraph(words, Mood.DOUBTFUL if doubt else Mood.PLAIN)]


def links_document(found: FoundLinks, nominal: ModelLinks, arm: Arm) -> Links:
    """Return the result of consistent links."""
    far = int(np.argmax(np.abs(found.moved)))
    links = [_link(found, nominal, arm, j) for j in range(arm.n)]
    return Links(
        links=tuple(links), farthest_parameter=found.names[far], farthest_deviations=float(abs(found.moved[far]))
    )


def _link(found: FoundLinks, nominal: ModelLinks, arm: Arm, j: int) -> Link:
    mass, *rest = body_values(found.own[j]).tolist()
    return Link.model_validate(
        {
            "joint": j + 1,
            "name": arm.joint_names[j],
            "mass": mass,
            "com": rest[:3],
            "inertia": dict(zip(INERTIA_KEYS, rest[3:], strict=True)),
            "motor_inertia": float(found.motor[j]),
            "motor_unit": "kg m^2" if arm.revolute[j] else "kg",
            "motor_found": bool(found.motor_found[j]),
            "carried": nominal.carried[j].tolist(),
            "place": arm.translation[j].tolist(),
            "orientation": arm.rotation[j].tolist(),
            "axis": arm.axis[j].tolist(),
        }
    )


def same_frames(link: Link, arm: Arm, carried: Array, *, tolerance: float) -> bool:
    """Return whether a link has the frame of an arm's link, with the same bodies fixed to it."""
    j = link.joint - 1
    pairs = (
        (link.place, arm.translation[j]),
        (link.orientation, arm.rotation[j]),
        (link.axis, arm.axis[j]),
        (link.carried, carried[j]),
    )
    return all(bool(np.allclose(one, other, rtol=tolerance, atol=tolerance)) for one, other in pairs)


def _alike(numbers: Sequence[float]) -> str:
    """Return numbers with the same decimals."""
    return " ".join(f"{x:z.{places_of(max(map(abs, numbers)))}f}" for x in numbers)
