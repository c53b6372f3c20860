"""Checks of the samples of one log, independent of the arm.

One file per check; `SAMPLE_CHECKS` lists them, `SPOILING` those that mark spoilt samples of joints.
"""

from collections.abc import Callable

from ident.diagnosis.diagnosis import Diagnosis
from ident.diagnosis.samples import clipping, clock, columns, frozen, lost_samples, motion, noise, values, wrapped
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording
from ident.support.arrays import Mask

SAMPLE_CHECKS: dict[str, Callable[[Recording, ObserveOptions], list[Diagnosis]]] = {
    "values": values.values,
    "wrapped": wrapped.wrapped,
    "clock": clock.clock,
    "lost samples": lost_samples.lost_samples,
    "clipping": clipping.clipping,
    "frozen": frozen.frozen,
    "noise": noise.noise,
    "columns": columns.columns,
    "motion": motion.motion,
}
FILTERED = ("noise", "columns", "motion")
"""Checks of logs that can be filtered."""
OF_THE_MOTION = ("values", "noise", "motion")
"""Checks of the quality of logs: standard deviations of gains include it, and bad values are refused."""
SPOILING: dict[str, Callable[[Recording], Mask]] = {
    "clipping": clipping.spoilt,
    "frozen": frozen.spoilt,
    "values": values.spoilt,
    "lost samples": lost_samples.lost_spoilt,
    "repeated samples": lost_samples.repeated_spoilt,
}
"""Functions that mark samples that each joint's gain must not use, shape (N, n), by the name of the diagnosis."""
