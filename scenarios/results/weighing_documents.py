"""Results of gains in use for programs: the JSON objects of `rx90 verify`, `payload-of` and `compare-gains`."""

from collections.abc import Sequence
from dataclasses import asdict

from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.cross_validation import JointPrediction
from ident.identification import Identification
from ident.model.parameters import UNITS
from ident.payload_identification.common_scale import CommonError, common_error
from ident.payload_identification.payload_body import FoundBody, Quantity
from ident.payload_identification.payload_estimate import FoundPayload
from ident.payload_identification.verification import Verification, Weighed
from scenarios.results.models.diagnoses import diagnosed_values


def verification_document(found: Verification, diagnosed: Diagnosed) -> dict[str, object]:
    """What a scale says of gains; masses are null where they do not show."""
    common = common_error(found)
    return {
        "passed": found.passed,
        "mass": found.payload.mass,
        "mass_std": found.payload.mass_std,
        "limit": found.limit,
        "together": _weighed(found.together),
        "joints": [_weighed(each) for each in found.joints],
        "payload": [_quantity(each) for each in found.body.quantities],
        "common": None if common is None else _common(common),
        "notes": list(found.remarks),
        **diagnosed_values(diagnosed),
    }


def prediction_document(identified: Identification, found: Sequence[JointPrediction]) -> dict[str, object]:
    """How well parts of the motions are predicted from the others."""
    estimate = identified.estimate
    return {
        "method": estimate.method,
        "joints": [
            {
                "joint": each.joint + 1,
                "name": estimate.joints[each.joint].joint,
                "predicted_rel_error": each.share,
                "fitted_rel_error": each.fitted,
                "gain_changes": each.gain_change.tolist(),
            }
            for each in found
        ],
        **diagnosed_values(identified.found),
    }


def payload_document(
    found: FoundPayload, body: FoundBody, joints: Sequence[Weighed], diagnosed: Diagnosed
) -> dict[str, object]:
    """A payload: parameters at the origin of the last frame with covariance, mass, centre and inertia, joints alone."""
    return {
        "parameters": [
            {
                "parameter": name,
                "unit": UNITS[name],
                "estimate": float(found.value[k]),
                "std": float(found.covariance[k, k] ** 0.5),
                "residual_std": float(found.residual[k, k] ** 0.5),
                "gain_std": float(found.gains[k, k] ** 0.5),
                "model_std": float(found.model[k, k] ** 0.5),
            }
            for k, name in enumerate(found.names)
        ],
        "covariance": found.covariance.tolist(),
        "body": [_quantity(each) for each in body.quantities],
        "refused": {**found.refused, **body.refused},
        "possible": body.possible,
        "joints": [_weighed(each) for each in joints],
        "notes": list(found.selected.remarks),
        **diagnosed_values(diagnosed),
    }


def _common(common: CommonError) -> dict[str, object]:
    return {
        "joints": [joint + 1 for joint in common.joints],
        "rel_error": common.rel_error,
        "rel_std": common.rel_std,
        "apart": [{**asdict(each), "joint": each.joint + 1} for each in common.apart],
    }


def _weighed(each: Weighed) -> dict[str, object]:
    mass = each.mass
    return {
        "joint": None if each.joint is None else each.joint + 1,
        "mass": mass and mass.value,
        "std": mass and mass.std,
        "residual_std": mass and mass.residual_std,
        "gain_std": mass and mass.gain_std,
        "model_std": mass and mass.model_std,
        "rel_error": each.rel_error,
        "rel_std": each.rel_std,
        "verdict": each.verdict,
        "reason": each.reason,
    }


def _quantity(each: Quantity) -> dict[str, object]:
    return {
        "quantity": each.name,
        "unit": each.unit,
        "estimate": each.value,
        "std": each.std,
        "residual_std": each.residual_std,
        "gain_std": each.gain_std,
        "model_std": each.model_std,
    }
