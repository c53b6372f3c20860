"""The result of `rx90 check` for programs; its keys are a contract."""

from dataclasses import asdict

from ident.arm import Arm
from ident.checks.check import Checked, LogRead
from ident.checks.remark import Remark


def check_document(found: Checked, arm: Arm) -> dict[str, object]:
    """The result as one JSON object.

    Args:
        found: What the check found.
        arm: That moved.
    """
    comparison = found.comparison
    return {
        "robot": arm.name,
        "verdict": found.grade.value,
        "lines": [_line(each) for each in found.all_remarks],
        "logs": [_log(each) for each in found.logs],
        "readings": {
            "better": list(found.named),
            "same": [] if comparison is None else [each.words for each in comparison.same],
            "out_of_reach": [] if comparison is None else [joint + 1 for joint in comparison.unreachable],
            "driven_by_friction": [joint + 1 for joint in found.backward],
        },
    }


def _line(remark: Remark) -> dict[str, object]:
    joint = None if remark.joint is None else remark.joint + 1
    return {
        "log": remark.log,
        "what": remark.topic,
        "joint": joint,
        "verdict": remark.grade.value,
        "seen": remark.seen,
        "advice": remark.advice,
    }


def _log(log: LogRead) -> dict[str, object]:
    motions = log.motions or ()
    return {"log": log.recording.name, "joints": [{"joint": j, **asdict(each)} for j, each in enumerate(motions, 1)]}
