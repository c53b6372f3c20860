"""Units that logs are in, and what one of them is in seconds, radians, metres and drive units."""

import math

ISO = "iso"
"""Time as dates, 2031-07-19T09:41:07.125."""
TICKS = "ticks"
"""Positions as counts of an encoder; what a turn of the joint has is said beside."""
TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, ISO: 1.0}
"""Seconds."""
POSITION = {"rad": 1.0, "deg": math.pi / 180.0, "rev": 2.0 * math.pi, "m": 1.0, "mm": 1e-3, TICKS: 2.0 * math.pi}
"""Radians or metres; of ticks, a turn."""
CURRENT = {"A": 1.0, "mA": 1e-3}
"""Amperes."""
SHARE = {"%": 1.0, "per mille": 0.1}
"""Percent."""
TORQUE = {"N m": 1.0, "Nm": 1.0, "mN m": 1e-3, "N": 1.0}
"""Newton metres, newtons of joints that slide."""
