"""Links of an arm from bare motions with known gains, or why there are none."""

from pathlib import Path

from ident.arm_parameters.bare import BareArm
from ident.arm_parameters.links import nearest_links
from ident.model.structure import Structure
from ident.support.errors import NoBody
from scenarios.experiments.nominal_links import KINEMATICS_ONLY, is_placeholder, nominal_links
from scenarios.gains_in_use.model_update.values import Unknown
from scenarios.results.models.links import Links, links_document
from sim.errors import ModelFileError

NO_GAINS = "without gains the parameters are not in SI units (--gains)"


def known_links(in_si: BareArm | None, structure: Structure, model: Path, flange: str | None) -> Links | Unknown:
    """Return the physically consistent links nearest to the model's.

    Args:
        in_si: Base parameters with known gains, None without any.
        structure: Identifiable structure of the arm.
        model: Model file, whose masses are used here.
        flange: Last body of the arm, if the file has more bodies.
    """
    if in_si is None:
        return Unknown(NO_GAINS)
    try:
        nominal = nominal_links(model, flange)
        if is_placeholder(nominal):
            return Unknown(KINEMATICS_ONLY)
        found = nearest_links(structure.base, in_si.inertial, in_si.inertial_covariance, nominal)
    except (ModelFileError, NoBody) as error:
        return Unknown(str(error))
    return links_document(found, nominal, structure.arm)
