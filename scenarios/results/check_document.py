"""The result of `rx90 check` for programs; its keys are a contract."""

from dataclasses import asdict

from ident.check import Checked, LogRead
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.model.arm import Arm
from scenarios.results.documents import diagnosed_document

LIMITS, FRICTION = "joint limits", "friction sign"
"""Names of diagnoses of joints that are where they cannot be, and of friction that drives."""


def check_document(checked: Checked, arm: Arm) -> dict[str, object]:
    """The result as one JSON object.

    Args:
        checked: What the check found.
        arm: That moved.
    """
    found = checked.found
    return {
        "robot": arm.name,
        "verdict": found.severity.value,
        "lines": [_line(each) for each in found.diagnoses],
        "logs": [_log(each) for each in checked.logs],
        "readings": {
            "better": [each.sentence for each in found.diagnoses if _predicts_better(each)],
            "same": list(found.indistinguishable),
            "out_of_reach": _joints(found, LIMITS),
            "driven_by_friction": _joints(found, FRICTION),
        },
        **diagnosed_document(found),
    }


def _predicts_better(diagnosis: Diagnosis) -> bool:
    """Whether it is another reading of the logs, not something that the samples show."""
    return diagnosis.z is not None and diagnosis.severity is Severity.WRONG


def _joints(found: Diagnosed, name: str) -> list[int]:
    return sorted({joint + 1 for each in found.findings if each.name == name for joint in each.joints})


def _line(diagnosis: Diagnosis) -> dict[str, object]:
    return {
        "log": diagnosis.logs[0] if len(diagnosis.logs) == 1 else None,
        "what": diagnosis.name,
        "joint": diagnosis.joints[0] + 1 if len(diagnosis.joints) == 1 else None,
        "verdict": diagnosis.severity.value,
        "seen": diagnosis.sentence,
        "advice": diagnosis.advice,
    }


def _log(log: LogRead) -> dict[str, object]:
    motions = log.motions or ()
    return {"log": log.recording.name, "joints": [{"joint": j, **asdict(each)} for j, each in enumerate(motions, 1)]}
