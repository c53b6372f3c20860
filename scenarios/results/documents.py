"""Results for programs: the JSON objects of `--json`, whose keys are a contract."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

from ident.diagnosis.candidates import SHOWN
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.estimation.estimate import GainEstimate, IdentifiedGain, JointResult, RefusedGain
from ident.identification import Identification
from ident.model.parameters import INERTIAL
from ident.payload.payload import standard_parameters

if TYPE_CHECKING:  # a process that only identifies needs no simulator
    from scenarios.experiments.build import Setup
    from scenarios.experiments.run import Run
    from sim.plant import PayloadBody


def run_document(run: "Run") -> dict[str, object]:
    """The result of `rx90 run` as one JSON object."""
    gains = [
        {**asdict(gain), **_more(joint)} for gain, joint in zip(run.verdict.gains, run.estimate.joints, strict=True)
    ]
    bodies = list(true_bodies(run.setup).values())
    true = _true_parameters(bodies[0]) if len(bodies) == 1 else {}  # of several, a name does not say whose it is
    return {
        "scenario": run.setup.scenario.name,
        "seed": run.seed,
        "passed": run.verdict.passed,
        "gains": gains,
        "payload": _payload(run.estimate, true),
        "fit": _fit(run.estimate),
        "timing": {"simulate_s": run.simulate_s, "identify_s": run.identify_s},
        "notes": list(run.notes),
        "consistency": consistency_document(run.found),
        **diagnosed_document(run.found),
    }


def true_bodies(setup: "Setup") -> "dict[str, PayloadBody]":
    """The payloads that are really mounted, by mounting."""
    return {
        carried: experiment.plant.payload
        for carried, experiment in zip(setup.protocol, setup.experiments, strict=True)
        if experiment.loaded
    }


def _true_parameters(body: "PayloadBody") -> dict[str, float]:
    values = standard_parameters(body.mass, body.com, body.inertia).tolist()
    return dict(zip(map(str, INERTIAL), values, strict=True))


def estimate_document(found: Identification, identify_s: float) -> dict[str, object]:
    """The result of `rx90 identify` as one JSON object of the same form; what needs a truth is null."""
    estimate = found.estimate
    gains = [
        {
            "joint": number,
            "true": None,
            "estimate": joint.value if isinstance(joint, IdentifiedGain) else None,
            "std": joint.total_std if isinstance(joint, IdentifiedGain) else None,
            "rel_error": None,
            "z": None,
            "tolerance": None,
            "identifiable": isinstance(joint, IdentifiedGain),
            "passed": None,
            "reason": joint.reason if isinstance(joint, RefusedGain) else None,
            **_more(joint),
        }
        for number, joint in enumerate(estimate.joints, 1)
    ]
    return {
        "scenario": None,
        "seed": None,
        "passed": None,
        "gains": gains,
        "payload": _payload(estimate, {}),
        "fit": _fit(estimate),
        "timing": {"simulate_s": None, "identify_s": identify_s},
        "notes": list(found.notes),
        "consistency": consistency_document(found.found),
        **diagnosed_document(found.found),
    }


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite would be no JSON and is an error."""
    return json.dumps(document, indent=2, allow_nan=False)


def _more(joint: JointResult) -> dict[str, object]:
    """What is known of a joint with or without a truth: its name, the parts of its deviation, what was predicted."""
    gain = joint if isinstance(joint, IdentifiedGain) else None
    return {
        "name": joint.joint,
        "residual_std": gain and gain.std,
        "payload_std": gain and gain.payload_std,
        "model_std": gain and gain.model_std,
        "total_std": gain and gain.total_std,
        "predicted_rel_std": joint.predicted_rel_std,
    }


def _payload(estimate: GainEstimate, true: Mapping[str, float]) -> list[dict[str, object]]:
    """The payload parameters that the method found on its way, beside the true ones where there are any."""
    return [
        {
            "parameter": found.name,
            "true": true.get(found.name),
            "estimate": found.value,
            "std": found.std,
            "tolerance": None,
            "passed": None,
        }
        for found in estimate.payload
    ]


def consistency_document(found: Diagnosed) -> list[dict[str, object]]:
    """In short, what was compared by its predictions of the currents."""
    return [
        {
            "check": each.name,
            "joint": (each.worst.joint if each.worst else each.joints[0] if each.joints else 0) + 1,
            "statistic": each.z,
            "threshold": SHOWN,
            "measure": "standard errors of the gain in predictions",
            "sentence": each.sentence if each.severity is not Severity.GOOD else None,
            "change": each.worst.percent if each.worst else None,
            "failed": each.severity is not Severity.GOOD,
        }
        for each in found.diagnoses
        if each.z is not None
    ]


def diagnosed_document(found: Diagnosed) -> dict[str, object]:
    """What is said of logs and estimate."""
    return {
        "diagnoses": [_diagnosis(each) for each in found.diagnoses],
        "excluded": [asdict(each) | {"joints": [joint + 1 for joint in each.joints]} for each in found.excluded],
        "untold": list(found.untold),
    }


def _diagnosis(diagnosis: Diagnosis) -> dict[str, object]:
    """Every field of a diagnosis, joints from 1."""
    own: dict[str, object] = {
        "severity": diagnosis.severity.value,
        "joints": [joint + 1 for joint in diagnosis.joints],
        "logs": list(diagnosis.logs),
        "effects": [asdict(each) | {"joint": each.joint + 1} for each in diagnosis.effects],
        "rivals": list(diagnosis.rivals),
    }
    return asdict(diagnosis) | own


def _fit(estimate: GainEstimate) -> dict[str, object]:
    return {
        "method": estimate.method,
        "rows": estimate.rows,
        "error_norm": estimate.error_norm,
        "rel_error_norm": estimate.rel_error_norm,
        "sigma": estimate.sigma,
    }
