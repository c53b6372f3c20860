"""Results for programs: the JSON objects of `--json`, whose keys are a contract."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from ident.gains import GainEstimate, JointGain
from scenarios.run import Run


@dataclass(frozen=True, slots=True, kw_only=True)
class GainParts:
    """An identified gain with its standard deviation and the parts of it [N m / drive unit]."""

    value: float
    std: float
    payload_std: float

    @property
    def total_std(self) -> float:
        """From the residual and the payload together."""
        return math.hypot(self.std, self.payload_std)


def gain_parts(joint: JointGain) -> GainParts | None:
    """The gain of a joint, None if it was refused."""
    if joint.value is None or joint.std is None:
        return None
    return GainParts(value=joint.value, std=joint.std, payload_std=joint.payload_rel_std * abs(joint.value))


def run_document(run: Run) -> dict[str, object]:
    """The result of `rx90 run` as one JSON object."""
    gains = [
        {**asdict(gain), **_more(joint)} for gain, joint in zip(run.verdict.gains, run.estimate.joints, strict=True)
    ]
    return {
        "scenario": run.bench.scenario.name,
        "seed": run.seed,
        "passed": run.verdict.passed,
        "gains": gains,
        "payload": [],
        "fit": _fit(run.estimate),
        "timing": {"simulate_s": run.simulate_s, "identify_s": run.identify_s},
        "notes": list(run.notes),
    }


def estimate_document(estimate: GainEstimate, notes: Sequence[str], identify_s: float) -> dict[str, object]:
    """The result of `rx90 identify` as one JSON object of the same form; what needs a truth is null."""
    gains = [
        {
            "joint": number,
            "true": None,
            "estimate": joint.value,
            "std": joint.std,
            "rel_error": None,
            "z": None,
            "tolerance": None,
            "identifiable": joint.value is not None,
            "passed": None,
            "reason": joint.reason,
            **_more(joint),
        }
        for number, joint in enumerate(estimate.joints, 1)
    ]
    return {
        "scenario": None,
        "seed": None,
        "passed": None,
        "gains": gains,
        "payload": [],
        "fit": _fit(estimate),
        "timing": {"simulate_s": None, "identify_s": identify_s},
        "notes": list(notes),
    }


def to_json(document: Mapping[str, object]) -> str:
    """Serialise; a number that is not finite would be no JSON and is an error."""
    return json.dumps(document, indent=2, allow_nan=False)


def _more(joint: JointGain) -> dict[str, object]:
    """What is known of a joint with or without a truth: its name, the parts of its deviation, what was predicted."""
    parts = gain_parts(joint)
    return {
        "name": joint.joint,
        "payload_std": parts and parts.payload_std,
        "total_std": parts and parts.total_std,
        "predicted_rel_std": joint.predicted_rel_std if math.isfinite(joint.predicted_rel_std) else None,
    }


def _fit(estimate: GainEstimate) -> dict[str, object]:
    return {
        "method": estimate.method,
        "rows": estimate.rows,
        "error_norm": estimate.error_norm,
        "rel_error_norm": estimate.rel_error_norm,
        "sigma": estimate.sigma,
    }
