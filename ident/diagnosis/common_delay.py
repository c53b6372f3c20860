"""The delay between currents and positions common to all logs and joints: its size, or why it is not corrected."""

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.limits import bounds
from ident.diagnosis.search import Exact, Fault, faults, survey

NAME = "delay"


def common_delay(logs: Logs) -> tuple[float, Diagnosis]:
    """Estimate the common delay of the currents of all logs and joints.

    It is accepted like any fault of the logs, and only if it is the first one and nothing else explains the currents
    equally well, as other faults may look like a delay.

    Returns:
        The delay to correct [s], 0 for none, and its diagnosis.
    """
    seen = survey(logs)
    first = next((each for each in faults(seen) if isinstance(each.found, Exact)), None)
    if first is not None:
        return _believed(first, logs)
    own = [each for each in seen.directions if each.family == NAME and _is_common(each.joints, each.logs, logs)]
    limits = [size for size in bounds(seen.logs.model.fits, own) if size is not None]
    shown = f"delays beyond {1e3 * limits[0]:.2g} ms are excluded" if limits else "these logs exclude no delay"
    return 0.0, _delay_diagnosis(f"no delay of the currents detected; {shown}", Severity.GOOD)


def _believed(first: Fault, logs: Logs) -> tuple[float, Diagnosis]:
    """Return the delay and its diagnosis from the first fault of the logs."""
    assert isinstance(first.found, Exact), "a fault of the logs"
    found = first.found.alternative
    if found.family != NAME or found.value is None or not _is_common(found.joints, found.logs, logs):
        return 0.0, _delay_diagnosis(f"delay not corrected, because another fault is more significant: {found.words}")
    if first.rivals:
        rivals = " or ".join(first.rival_words)
        return 0.0, _delay_diagnosis(
            f"delay not corrected: {found.words}, which these logs cannot distinguish from: {rivals}"
        )
    way, std = "late" if found.value > 0.0 else "early", first.found.std
    size = f"{abs(found.value):.2g}" if std is None else _rounded(abs(found.value), std)
    return 1e-3 * found.value, Diagnosis(
        name=NAME,
        severity=Severity.WEAK,
        sentence=f"the currents are logged {size} ms {way}: corrected",
        value=found.value,
        std=std,
        unit="ms",
        z=first.z,
    )


def _delay_diagnosis(sentence: str, severity: Severity = Severity.WEAK) -> Diagnosis:
    return Diagnosis(name=NAME, severity=severity, sentence=sentence, asked=True)


def _is_common(joints: tuple[int, ...], of_logs: tuple[int, ...], logs: Logs) -> bool:
    """Whether a delay is common to all joints in all logs."""
    return not joints and len(of_logs) == len(logs.recordings)


def _rounded(size: float, std: float) -> str:
    """A size and its standard deviation, rounded by the latter."""
    places = max(0, -int(np.floor(np.log10(std)))) if std > 0.0 else 2
    return f"{size:.{places}f} ± {std:.{places}f}"
